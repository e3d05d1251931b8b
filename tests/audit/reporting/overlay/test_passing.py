import numpy as np
import pytest

from mtm_audit import DecodeSettings, decode_tracks
from mtm_audit.reporting.overlay.passing import Windows, tracks_by_body, windows_of
from tests.audit.moving_robot import OTHER_SECRET, key_of, robot_track, scheme_of

KEY = key_of(scheme_of(symbols=(2,), ticks=400))
SYMBOLS = (3, 1)
TRACK = robot_track(KEY, "robot0", SYMBOLS, 18.0, onset_s=1.0)
WINDOWS = Windows("robot0", "marker0", "robot0", np.array([1.0, 5.0]), 4.0, ("3", "1 ?"))


@pytest.fixture(scope="module")
def decoding():
    return decode_tracks([TRACK], KEY, DecodeSettings(onset_s=1.0))


def test_a_window_passes_from_its_start_to_its_end():
    assert WINDOWS.passing(0.9) is None
    assert (WINDOWS.passing(1.0).symbol, WINDOWS.passing(1.0).passed) == ("3", 0.0)
    assert WINDOWS.passing(4.0).passed == pytest.approx(0.75)
    assert WINDOWS.passing(5.0).symbol == "1 ?"
    assert WINDOWS.passing(9.0) is None


def test_the_symbols_of_a_message_pass_again_and_again(decoding):
    (windows,) = windows_of(decoding, 0.0, 1.0)
    assert (windows.body, windows.track) == ("robot0", "robot0")
    assert [windows.passing(time_s).symbol for time_s in (2.0, 6.0, 10.0, 14.0)] == ["3", "1", "3", "1"]


def test_slow_motion_is_drawn_in_the_time_of_the_file(decoding):
    (own,), (slow,) = windows_of(decoding, 0.5, 1.0), windows_of(decoding, 0.5, 4.0)
    assert slow.length_s == pytest.approx(4.0 * own.length_s)
    assert slow.starts_s - 0.5 == pytest.approx(4.0 * (own.starts_s - 0.5))


def test_without_a_message_no_symbol_and_no_body_is_named():
    absent = decode_tracks([TRACK], key_of(KEY.scheme, OTHER_SECRET), DecodeSettings(onset_s=1.0))
    assert absent.verdict == "absent"
    assert windows_of(absent, 0.0, 1.0) == ()
    assert tracks_by_body(absent) == {}


def test_bodies_have_the_tracks_of_the_decode(decoding):
    assert tracks_by_body(decoding) == {"robot0": "robot0"}
