"""From poses to tracks: which axis of a body is its heading, and what is said of it."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mtm_audit.readers.logs.body import Body, track_of

YAWS = np.linspace(0.0, 2.0, 20)
LEVEL = Rotation.from_euler("z", YAWS[:, None])


def read(heading_axis=None, *, turns=LEVEL, **changes):
    """The track of a body, and what was said of it."""
    poses = {"quaternions_xyzw": turns.as_quat(), **changes}
    warnings = []
    body = Body("robot0", 0.1 * np.arange(20), np.zeros((20, 3)), **poses)
    return track_of(body, "take.csv", warnings.append, heading_axis), warnings


def test_the_axis_that_was_taken_is_told():
    assert read()[0].heading_axis == "x"
    assert read(turns=LEVEL * Rotation.from_euler("y", 1.5))[0].heading_axis == "y"
    track, warnings = read("-y")
    assert (track.heading_axis, warnings) == ("-y", [])
    assert track.headings_rad == pytest.approx(YAWS - np.pi / 2)


def test_an_axis_that_stands_upright_gives_way_with_a_word():
    track, (warning,) = read("z")
    assert (track.heading_axis, track.headings_rad) == ("x", pytest.approx(YAWS))
    assert warning == (
        "take.csv: the z axis of robot0 stands upright and shows no heading, so its x axis is taken; give another "
        "--heading-axis, or check --up"
    )


@pytest.mark.parametrize("yaws", [YAWS, None], ids=["yaw", "no turn"])
def test_an_axis_of_a_body_without_an_orientation_is_not_used(yaws):
    track, (warning,) = read("z", quaternions_xyzw=None, headings_rad=yaws)
    assert track.heading_axis is None
    assert warning == ("take.csv: how robot0 is turned in three dimensions is not there, so --heading-axis is not used")
    assert read(quaternions_xyzw=None, headings_rad=yaws)[1] == []


def test_an_orientation_that_was_never_measured_is_no_heading():
    track, _ = read(quaternions_xyzw=np.full((20, 4), np.nan))
    assert (track.headings_rad, track.heading_axis) == (None, None)
    track, (warning,) = read("z", quaternions_xyzw=np.full((20, 4), np.nan))
    assert (track.headings_rad, track.heading_axis) == (None, None)
    assert "how robot0 is turned" in warning
