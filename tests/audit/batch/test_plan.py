import pickle
from dataclasses import replace

import numpy as np
import pytest

from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.detectors.matched.plants import FINE
from mtm_audit.detectors.matched.profile import PlantProfile
from mtm_audit.model.lens import Lens
from mtm_audit.model.recorded_at import RecordedAt
from mtm_audit.readers.logs.options import ReadOptions
from mtm_onboard.protocol import MtmError
from mtm_onboard.protocol.revocation import RevocationList
from tests.audit.batch.recordings import FAKE_SECRET, plan_of, save_keys

PROFILE = PlantProfile(np.full(len(FINE.taps), 1.0 / len(FINE.taps)))
LENS = Lens(name="a.yaml", size_px=(8, 6), focal_px=(9.0, 9.0), centre_px=(3.5, 2.5), distortion=(-0.3, 0.1, 0.0, 0.0))
OTHER_PLANS = {
    "tracker": "colour:red", "reference": ("marker1",), "frame_rate_hz": 30.0, "speed": None, "code": "0" * 16,
    "reading": ReadOptions(bodies={"robot0": ("left", "right")}), "settings": DecodeSettings(onset_s=1.5),
    "lens": LENS,
}  # fmt: skip


@pytest.fixture
def keys(tmp_path):
    return save_keys(tmp_path)


def test_runs_that_ask_the_same_are_the_same(keys, tmp_path):
    assert plan_of(keys, tmp_path / "a").run == plan_of(keys, tmp_path / "b").run


def test_whatever_changes_rows_is_another_run(keys, tmp_path):
    plan = plan_of(keys, tmp_path)
    plans = [plan, *(replace(plan, **{name: value}) for name, value in OTHER_PLANS.items())]
    plans += [plan_of(keys[:1], tmp_path), plan_of(keys[1:], tmp_path)]
    for changed in ({"profile": PROFILE}, {"at": RecordedAt(1.7e9)}, {"threshold": 1e-5}, {"assignment": {"a": "b"}}):
        plans.append(replace(plan, settings=replace(plan.settings, **changed)))
    assert len({each.run for each in plans}) == len(plans)


def test_no_secret_travels_with_a_plan(keys, tmp_path):
    sent = pickle.dumps(plan_of(keys, tmp_path))
    assert FAKE_SECRET not in sent
    assert FAKE_SECRET.hex().encode() not in sent


def test_a_key_that_is_named_twice_is_not_paid_for_twice(keys, tmp_path):
    copy = tmp_path / "copy.key"
    copy.write_bytes(keys[0].read_bytes())
    copy.chmod(0o600)
    with pytest.raises(MtmError, match=r"fake\.key and .*copy\.key hold the same key; name it once"):
        plan_of([*keys, copy], tmp_path)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [("other", "not the one that the batch began with"), ("gone", "each machine needs it there")],
)
def test_another_file_in_a_key_s_place_is_noticed(keys, tmp_path, change, sentence):
    plan = plan_of(keys[:1], tmp_path)
    keys[0].unlink()
    if change == "other":
        keys[1].rename(keys[0])
    with pytest.raises(MtmError, match=sentence):
        plan.keys[0].load()


def test_a_key_that_may_not_be_used_is_named(tmp_path, keys, monkeypatch):
    monkeypatch.setattr(RevocationList, "check", lambda self, key: (_ for _ in ()).throw(MtmError("it was revoked")))
    with pytest.raises(MtmError, match=r"fake\.key: it was revoked"):
        plan_of(keys, tmp_path)
