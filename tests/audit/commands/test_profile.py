import json
from dataclasses import replace

import numpy as np
import pytest

from hil.sensors.motion_capture import write_tum
from mtm_audit.cli import main
from mtm_audit.detectors.matched.plants import FINE
from mtm_audit.detectors.matched.profile import PlantProfile, load_profile, save_profile
from mtm_onboard.protocol import save_key
from tests.audit.moving_robot import FAKE_SECRET, key_of, robot_track, scheme_of

KEY = key_of(scheme_of(symbols=(1,), ticks=300))


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A key, motion capture of a robot that sent 3, and of one that sent nothing."""
    path = tmp_path_factory.mktemp("profile")
    save_key(KEY, path / "robot.key")
    for name, symbols in (("sent", (3,)), ("silent", None)):
        (path / name).mkdir()
        track = robot_track(KEY, "robot0", symbols, 7.6, onset_s=1.0)
        write_tum(replace(track, headings_rad=np.zeros(len(track.times_s))), path / name / "robot0.tum")
    return path


@pytest.fixture
def audit(folder, capsys):
    """Run `mtm-audit` with the key; gives the exit code, standard output and standard error."""

    def run(command, *arguments):
        with pytest.raises(SystemExit) as left:
            main([command, *map(str, arguments), "--key", str(folder / "robot.key"), "--onset", "1"])
        out, err = capsys.readouterr()
        assert "Traceback" not in out + err
        return left.value.code or 0, out, err

    return run


def test_a_profile_is_learnt_written_and_used(audit, folder, tmp_path):
    path = tmp_path / "robot.profile"
    code, out, err = audit("profile", folder / "sent", "--out", path)
    assert (code, err) == (0, "")
    assert "robot.profile" in out
    assert load_profile(path).weights.sum() == pytest.approx(1.0)
    assert FAKE_SECRET.hex() not in path.read_text(encoding="utf-8")
    decode = ("decode", folder / "sent", "--detector", "matched", "--json")
    plain, known = (json.loads(audit(*decode, *more)[1]) for more in ((), ("--profile", path)))
    assert known["message"] == plain["message"] == 3
    assert known["channels"][0]["scores"] != plain["channels"][0]["scores"]


def test_nothing_is_learnt_from_a_recording_without_a_message(audit, folder, tmp_path):
    path = tmp_path / "robot.profile"
    code, _, err = audit("profile", folder / "silent", "--out", path)
    assert code == 1
    assert "the verdict on this recording is 'absent'" in err
    assert not path.exists()


def test_a_folder_that_is_not_there_is_refused_before_the_work(audit, tmp_path):
    code, _, err = audit("profile", tmp_path / "nothing", "--out", tmp_path / "no" / "robot.profile")
    assert code == 1
    assert "there is no folder" in err
    assert err.count("\n") == 1


@pytest.mark.parametrize(
    ("text", "sentence"), [(None, "cannot read the profile"), ("format = 7\n", "profile format 7")]
)
def test_an_unusable_profile_is_refused_in_one_sentence(audit, folder, tmp_path, text, sentence):
    path = tmp_path / "robot.profile"
    if text is not None:
        path.write_text(text, encoding="utf-8")
    code, out, err = audit("decode", folder / "sent", "--detector", "matched", "--profile", path)
    assert (code, out) == (1, "")
    assert sentence in err
    assert err.count("\n") == 1


def test_a_detector_that_takes_no_profile_says_so(audit, folder, tmp_path):
    path = tmp_path / "robot.profile"
    save_profile(PlantProfile(np.full(len(FINE.taps), 1 / len(FINE.taps))), path)
    code, _, err = audit("decode", folder / "sent", "--detector", "coherency", "--profile", path)
    assert code == 1
    assert "takes no profile; leave --profile out or choose --detector matched" in err
