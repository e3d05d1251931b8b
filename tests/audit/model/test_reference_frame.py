"""Motion along a robot's own axes, by its heading or by its path."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_audit.model.glimpse import glimpse_of_track
from mtm_audit.model.reference_frame import along_own_axes, headings_along_path, known_frames, turning
from mtm_audit.model.track import Track
from mtm_onboard.protocol.errors import MtmError

STEP_S = 0.01
TIMES_S = np.arange(2000) * STEP_S


def driven(forward_mps, lateral_mps, yaw_radps, *, headings=True, first_rad=0.3):
    """A track of a robot that is driven with velocities (n,) along its own axes."""
    headings_rad = first_rad + np.concatenate([[0.0], np.cumsum(yaw_radps[:-1]) * STEP_S])
    middles_rad = headings_rad + 0.5 * yaw_radps * STEP_S
    velocities = (forward_mps + 1j * lateral_mps) * np.exp(1j * middles_rad)
    places = np.concatenate([[0.0], np.cumsum(velocities[:-1]) * STEP_S])
    positions = np.stack([places.real, places.imag], axis=1)
    seen = np.ones(len(TIMES_S), dtype=bool)
    return Track("robot0", TIMES_S, positions, seen, headings_rad=headings_rad if headings else None)


def swinging(hz, size):
    return size * np.sin(2.0 * np.pi * hz * TIMES_S)


@given(st.floats(-2.0, 2.0), st.floats(-3.0, 3.0))
def test_turned_by_the_heading_motion_is_what_the_robot_did(spin_radps, first_rad):
    forward, lateral = 0.3 + swinging(1.1, 0.1), swinging(0.7, 0.2)
    track = driven(forward, lateral, np.full(2000, spin_radps), first_rad=first_rad)
    own = along_own_axes(glimpse_of_track(track), "body")
    assert own.axes == ("forward", "lateral")
    assert own.velocities[:, 0] == pytest.approx(forward[:-1], abs=1e-6)
    assert own.velocities[:, 1] == pytest.approx(lateral[:-1], abs=1e-6)


def test_headings_that_jump_by_a_turn_are_one_rotation():
    track = driven(np.full(2000, 0.5), np.zeros(2000), np.full(2000, 1.5))
    wrapped = Track("robot0", TIMES_S, track.positions, track.valid,
                    headings_rad=np.angle(np.exp(1j * track.headings_rad)))  # fmt: skip
    yaw = turning(glimpse_of_track(wrapped), "body")
    assert yaw is not None
    assert yaw.axes == ("yaw",)
    assert yaw.velocities[:, 0] == pytest.approx(1.5)


def test_the_path_shows_the_heading_of_what_cannot_move_sideways():
    yaw_radps = swinging(0.9, 0.6)
    track = driven(0.4 + swinging(0.5, 0.1), np.zeros(2000), yaw_radps, headings=False)
    found = headings_along_path(glimpse_of_track(track))
    true = 0.3 + np.concatenate([[0.0], np.cumsum(yaw_radps[:-1]) * STEP_S])
    away = np.angle(np.exp(2j * (found - true))) / 2.0
    assert np.max(np.abs(away[20:-20])) < 0.02


def test_a_robot_that_backs_up_keeps_its_heading_by_the_path():
    """Which end leads nobody sees, and going back is no half turn."""
    track = driven(swinging(0.3, 0.5), np.zeros(2000), np.full(2000, 0.2), headings=False)
    assert np.ptp(np.unwrap(2.0 * headings_along_path(glimpse_of_track(track)))) / 2.0 == pytest.approx(4.0, abs=0.1)


def test_only_robots_that_turn_have_a_frame_of_their_own():
    forward, still = np.full(2000, 0.3), np.zeros(2000)
    assert known_frames(glimpse_of_track(driven(forward, still, swinging(0.5, 0.1)))) == ("world",)
    assert known_frames(glimpse_of_track(driven(forward, still, np.full(2000, 0.5)))) == ("world", "body")
    assert known_frames(glimpse_of_track(driven(forward, still, still, headings=False))) == ("world", "path")


def test_an_arm_has_neither_heading_nor_path():
    arm = Track("arm", TIMES_S, np.sin(TIMES_S)[:, None], np.ones(2000, dtype=bool), axes=("angle",), unit="rad")
    glimpse = glimpse_of_track(arm)
    assert known_frames(glimpse) == ("world",)
    assert turning(glimpse, "path") is None
    assert along_own_axes(glimpse, "path") is glimpse


def test_missing_headings_are_bridged_unless_most_are_missing():
    track = driven(np.full(2000, 0.5), np.zeros(2000), np.full(2000, 1.0))
    gapped, sparse = track.headings_rad.copy(), track.headings_rad.copy()
    gapped[500:600], sparse[:1200] = np.nan, np.nan
    rows = (TIMES_S, track.positions, track.valid)
    bridged = glimpse_of_track(Track("robot0", *rows, headings_rad=gapped))
    assert bridged.headings_rad == pytest.approx(track.headings_rad)
    assert glimpse_of_track(Track("robot0", *rows, headings_rad=sparse)).headings_rad is None


def test_headings_of_another_length_are_refused():
    track = driven(np.full(2000, 0.5), np.zeros(2000), np.zeros(2000))
    with pytest.raises(MtmError, match="headings differ in length"):
        Track("robot0", TIMES_S, track.positions, track.valid, headings_rad=track.headings_rad[:-1])
