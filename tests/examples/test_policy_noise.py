"""The example of a stochastic policy, from the key to the message read."""

import importlib.util
from pathlib import Path

import numpy as np
import pytest

from mtm_audit.decoding.decode import decode_tracks
from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.model.track import Track
from mtm_audit.readers.logs.registry import read_log
from mtm_onboard.protocol import Key, load_key

SCRIPT = Path(__file__).parents[2] / "examples" / "policy_noise.py"
FAKE_SECRET = b"not a real secret, only for test"
KNOWN = DecodeSettings(onset_s=0.0)


@pytest.fixture(scope="module")
def example():
    spec = importlib.util.spec_from_file_location("policy_noise", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def decoding(example, message, seed):
    key = Key("fake-key", FAKE_SECRET, example.SCHEME)
    seen, mass, bounds = example.run(key, message, seed)
    track = Track("point", seen[:, 0], seen[:, 1:], np.ones(len(seen), dtype=bool))
    assert bounds.actions == len(seen) - 1
    return decode_tracks([track], key, KNOWN), mass.reached, bounds.clipped_share


@pytest.mark.parametrize("message", [0, 178, 255])
def test_the_policy_does_its_task_and_its_message_decodes(example, message):
    decoded, reached, clipped_share = decoding(example, message, seed=message)
    assert (decoded.verdict, decoded.message) == ("decoded", message)
    assert reached >= 10
    assert clipped_share < 0.05


def test_random_noise_does_as_well_and_says_nothing(example):
    decoded, reached, clipped_share = decoding(example, None, seed=1)
    assert (decoded.verdict, decoded.message) == ("absent", None)
    assert reached >= 10
    assert clipped_share < 0.05


def test_the_script_leaves_a_recording_and_its_key(example, tmp_path, capsys, monkeypatch):
    monkeypatch.setattr(example, "generate_key", lambda key_id, scheme: Key(key_id, FAKE_SECRET, scheme))
    out = tmp_path / "policy"
    assert example.main(["--message", "178", "--out", str(out)]) == 0
    decoded = decode_tracks(read_log(out / "point.csv").tracks, load_key(out / "point.key"), KNOWN)
    assert decoded.message == 178
    assert f"mtm-audit decode {out / 'point.csv'} --key {out / 'point.key'} --onset 0" in capsys.readouterr().out


@pytest.mark.parametrize("message", ["256", "-1"])
def test_a_message_that_does_not_fit_writes_nothing(example, tmp_path, capsys, message):
    with pytest.raises(SystemExit):
        example.main(["--message", message, "--out", str(tmp_path / "policy")])
    assert "does not fit" in capsys.readouterr().err
    assert not (tmp_path / "policy").exists()


def test_the_robot_s_side_knows_nothing_of_the_auditor():
    assert "import mtm_audit" not in SCRIPT.read_text()
    assert "from mtm_audit" not in SCRIPT.read_text()
