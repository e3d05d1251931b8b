import cv2
import numpy as np
import pytest

from mtm_audit.model.picture import Frame
from mtm_audit.tracking.centroid import CentroidTracker
from mtm_audit.tracking.registry import tracker
from mtm_onboard.protocol import MtmError

TIMES_S = np.arange(60) / 10
PLACES_PX = np.stack([100.0 + 50 * np.cos(TIMES_S), 90.0 + 40 * np.sin(1.3 * TIMES_S)], axis=1)


def film(places_px=PLACES_PX, hidden=(), rival_px=None):
    """A blue disc that black lines cut into sectors, on white, drawn at four times the size."""
    for number, place in enumerate(places_px):
        image = np.full((800, 800, 3), 255, np.uint8)
        centre = 4 * place + 1.5
        if number not in hidden:
            cv2.circle(image, np.round(centre * 16).astype(int).tolist(), 48 * 16, (191, 64, 64), -1, cv2.LINE_AA, 4)
            for angle_rad in np.arange(5) * np.pi / 5 + 0.3:
                along = 60 * np.array([np.cos(angle_rad), np.sin(angle_rad)])
                ends = [np.round((centre + sign * along) * 16).astype(int).tolist() for sign in (-1, 1)]
                cv2.line(image, *ends, (0, 0, 0), 6, cv2.LINE_AA, 4)
        if rival_px is not None:
            cv2.circle(image, rival_px, 40, (191, 64, 64), -1, cv2.LINE_AA)
        yield Frame(number / 10, cv2.resize(image, (200, 200), interpolation=cv2.INTER_AREA))


def errors_px(track):
    expected = np.column_stack([PLACES_PX[:, 0], 199 - PLACES_PX[:, 1]])
    return np.abs(track.positions - expected)[track.valid]


def test_a_thing_in_pieces_is_followed_by_all_of_them():
    (track,) = tracker("centroid:#4040bf").track(film())
    assert track.valid.all()
    assert errors_px(track).max() < 0.15


def test_what_is_out_of_reach_of_a_seen_thing_does_not_count():
    frames = list(film(PLACES_PX[:1])) + list(film(PLACES_PX, rival_px=(720, 720)))[1:]
    (track,) = CentroidTracker("#4040bf", 25).track(frames)
    assert errors_px(track).max() < 0.15


def test_a_frame_without_it_is_missing():
    (track,) = tracker("centroid:blue,40").track(film(hidden=range(20, 25)))
    assert np.flatnonzero(~track.valid).tolist() == list(range(20, 25))


def test_a_colour_that_is_never_seen_is_named():
    with pytest.raises(MtmError, match="nothing of the colour yellow found in 60 frames"):
        tracker("centroid:yellow").track(film())


@pytest.mark.parametrize("choice", ["blue,0", "blue,wide", "blue,10,20", "gray8"])
def test_a_choice_that_says_nothing_is_refused(choice):
    with pytest.raises(MtmError):
        tracker(f"centroid:{choice}")
