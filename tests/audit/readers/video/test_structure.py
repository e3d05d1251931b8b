import numpy as np
import pytest

from mtm_audit.readers.video.structure import read_structure
from tests.audit.readers.video.films import Encoding, pictures, remux, turn, write_film


def test_container_codec_and_stored_size_are_told(tmp_path):
    found = read_structure(write_film(tmp_path / "film.mp4", pictures(5)))
    assert (found.container, found.codec, found.width_px, found.height_px) == ("mp4", "h264", 128, 96)
    assert (found.turned_deg, found.mirrored, found.times, found.hidden) == (0, False, "stated", 0)


def test_pictures_that_an_edit_list_hides_are_counted(tmp_path):
    gops = Encoding(options={"g": "60", "bf": "0", "sc_threshold": "0"})
    whole = write_film(tmp_path / "whole.mp4", pictures(240), gops)
    assert read_structure(remux(whole, tmp_path / "cut.mp4", from_s=2.5)).hidden == 15


@pytest.mark.parametrize(
    ("name", "encoding", "rate_hz", "times"),
    [
        ("film.mkv", Encoding(), None, "stated"),
        ("film.avi", Encoding(), None, "order"),
        ("film.h264", Encoding(format="h264"), None, "even"),
        ("film.mkv", Encoding(), 60.0, "even"),
    ],
)
def test_it_is_told_where_times_come_from(tmp_path, name, encoding, rate_hz, times):
    assert read_structure(write_film(tmp_path / name, pictures(10), encoding), rate_hz).times == times


@pytest.mark.parametrize("upper_lower", [False, True])
@pytest.mark.parametrize("left_right", [False, True])
@pytest.mark.parametrize("degrees", [0, 90, 180, 270])
def test_turn_and_mirror_are_what_players_do(tmp_path, degrees, left_right, upper_lower):
    film = turn(write_film(tmp_path / "film.mp4", pictures(5)), degrees, left_right=left_right, upper_lower=upper_lower)
    found = read_structure(film)
    picture = np.arange(12).reshape(3, 4)
    shown = np.rot90(picture, degrees // 90)
    shown = shown[:, ::-1] if left_right else shown
    shown = shown[::-1] if upper_lower else shown
    told = np.rot90(picture, -found.turned_deg // 90)
    assert np.array_equal(told[:, ::-1] if found.mirrored else told, shown)


def test_an_odd_turn_is_none(tmp_path):
    found = read_structure(turn(write_film(tmp_path / "film.mp4", pictures(5)), 30))
    assert (found.turned_deg, found.mirrored) == (None, False)
