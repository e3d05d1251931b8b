"""What `mtm_onboard` exports is a promise: the list is held here, and importing it stays cheap."""

import subprocess
import sys

import pytest

import mtm_onboard
from tests.onboard.schemes import FAKE_SECRET, small_scheme

NAMES = [
    "SILENCE", "ActionBounds", "BaseCommandClient", "BodyVelocity", "Channel", "Codebook", "Guard", "Key",
    "KeyedActionNoise", "KeyedGaussian", "KeyedNoise", "Limits", "Modulator", "MtmError", "Scheme", "Staleness",
    "VectorKeyedActionNoise", "VectorKeyedNoise", "add_to_actions", "generate_key", "load_key", "message_of",
    "register_with_stable_baselines3", "save_key",
]  # fmt: skip


def python(program: str) -> str:
    done = subprocess.run([sys.executable, "-W", "error", "-c", program], capture_output=True, text=True, check=False)
    assert done.stderr == ""
    return done.stdout


def test_these_names_are_public():
    assert mtm_onboard.__all__ == NAMES
    assert set(NAMES) <= set(dir(mtm_onboard))


@pytest.mark.parametrize("name", NAMES)
def test_a_public_name_is_documented(name):
    assert getattr(mtm_onboard, name).__doc__


def test_any_other_name_is_unknown():
    with pytest.raises(AttributeError, match="no attribute 'Modulater'"):
        mtm_onboard.Modulater  # noqa: B018


def test_the_import_alone_loads_nothing():
    loaded = python("import mtm_onboard, sys; print(*sys.modules)").split()
    assert not [name for name in loaded if name.startswith(("mtm_onboard.", "numpy"))]


def test_a_key_s_modules_do_not_bring_the_runtime():
    loaded = python("from mtm_onboard import load_key; import sys; print(*sys.modules)").split()
    assert "mtm_onboard.protocol.key" in loaded
    assert not [name for name in loaded if name.startswith(("mtm_onboard.runtime", "mtm_onboard.policies"))]


def test_the_public_names_carry_a_message(tmp_path):
    key = mtm_onboard.Key("fake", FAKE_SECRET, small_scheme())
    mtm_onboard.save_key(key, tmp_path / "robot.key")
    loaded = mtm_onboard.load_key(tmp_path / "robot.key")
    modulator = mtm_onboard.Modulator(loaded.codebook(), "a", mtm_onboard.message_of(42, loaded))
    noise = mtm_onboard.KeyedNoise([modulator], ("vx", "vy"))
    assert noise().tolist() == modulator.perturbation(0).tolist()
    assert noise().any()
