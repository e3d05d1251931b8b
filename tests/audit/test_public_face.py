"""What `mtm_audit` exports is a promise: the list is held here, and importing it stays cheap."""

import subprocess
import sys

import pytest

import mtm_audit
from tests.audit.moving_robot import key_of, robot_track, scheme_of

NAMES = [
    "ChannelDecoding", "DecodeSettings", "Decoding", "Evidence", "Key", "Lens", "MtmError", "ReadOptions",
    "RecordedAt", "Track", "decode", "decode_tracks", "load_key", "read_lens",
]  # fmt: skip


def test_these_names_are_public():
    assert mtm_audit.__all__ == NAMES
    assert set(NAMES) <= set(dir(mtm_audit))


@pytest.mark.parametrize("name", NAMES)
def test_a_public_name_is_documented(name):
    assert getattr(mtm_audit, name).__doc__


def test_any_other_name_is_unknown():
    with pytest.raises(AttributeError, match="no attribute 'decoed'"):
        mtm_audit.decoed  # noqa: B018


def test_the_import_alone_loads_no_numpy():
    program = "import sys, mtm_audit; print('numpy' in sys.modules)"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout == "False\n"


def test_files_are_decoded_in_one_call(tmp_path):
    key = key_of(scheme_of(symbols=(1,), ticks=400))
    track = robot_track(key, "robot0", (3,), 18.0, onset_s=1.0)
    rows = [f"{time_s:.4f},{x:.6f},{y:.6f}" for time_s, (x, y) in zip(track.times_s, track.positions, strict=True)]
    file = tmp_path / "robot0.csv"
    file.write_text("\n".join(["time,x,y", *rows]) + "\n")
    decoding = mtm_audit.decode(file, key, settings=mtm_audit.DecodeSettings(onset_s=1.0))
    assert (decoding.verdict, decoding.symbols) == ("decoded", (3,))
