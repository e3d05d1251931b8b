from dataclasses import replace

import numpy as np
import pytest

from hil.experiments.detectors.body_frame import turned
from hil.experiments.real.added import displacements, with_message
from hil.fleet.sending import Sending
from hil.plants.linear_response import LinearResponse
from mtm_audit.model.track import Track
from mtm_onboard.protocol import Key, MtmError
from tests.audit.moving_robot import scheme_of

AT_ONCE = {axis: LinearResponse() for axis in ("vx", "vy", "wz")}


def sending(axes=("vx", "vy"), **changes):
    scheme = scheme_of(ticks=100)
    scheme = replace(scheme, channels=(replace(scheme.channels[0], axes=axes),))
    key = Key("fake", bytes(32), scheme)
    given = dict(codebook=key.codebook(), channel=scheme.channels[0], symbols=(1,), onset_s=1.0, messages=2, sigma=0.1)
    return Sending(**{**given, **changes})


def track(headings=None, count=600, step_s=0.01):
    times_s = np.arange(count) * step_s
    positions = np.stack([0.3 * times_s, np.sin(times_s)], axis=1)
    return Track("robot", times_s, positions, np.ones(count, bool), headings_rad=headings)


def test_in_the_world_frame_the_noise_moves_the_robot_as_played():
    quiet = track()
    moved = with_message(quiet, sending(), AT_ONCE, "world").positions - quiet.positions
    played = 0.01 * np.cumsum(sending().noise(quiet.times_s), axis=0)
    assert moved[1:] == pytest.approx(played[:-1], abs=1e-9)
    assert np.abs(moved).max() > 0.005


def test_in_the_body_frame_it_is_turned_by_the_heading():
    headings = np.full(600, np.pi / 2)
    quiet = track(headings)
    world = with_message(quiet, sending(), AT_ONCE, "world").positions - quiet.positions
    body = with_message(quiet, sending(), AT_ONCE, "body").positions - quiet.positions
    assert body == pytest.approx(turned(world, headings), abs=1e-9)


def test_noise_on_the_turn_rate_bends_the_path_behind_it():
    straight = track(np.zeros(600))
    straight.positions[:, 1] = 0.0
    loud = with_message(straight, sending(("vx", "wz")), AT_ONCE, "body")
    played = displacements(straight.times_s, sending(("vx", "wz")), AT_ONCE)
    assert loud.headings_rad == pytest.approx(played[:, 1])
    ahead = np.diff(straight.positions[:, 0]) + np.diff(played[:, 0])
    middle = 0.5 * (played[1:, 1] + played[:-1, 1])
    assert np.diff(loud.positions[:, 1]) == pytest.approx(ahead * np.sin(middle))


def test_samples_that_were_not_seen_are_left_out():
    headings = np.zeros(600)
    headings[100:110] = np.nan
    quiet = track(headings)
    quiet.valid[200:220] = False
    loud = with_message(quiet, sending(), AT_ONCE, "body")
    assert len(loud.times_s) == 570
    assert np.all(np.isfinite(loud.positions))
    assert len(with_message(quiet, sending(), AT_ONCE, "world").times_s) == 580


def test_a_response_delays_and_scales_the_noise():
    times_s = np.arange(600) * 0.01
    slow = {"vx": LinearResponse(gain=0.5, delay_s=0.2), "vy": LinearResponse(gain=0.5, delay_s=0.2)}
    assert displacements(times_s, sending(), slow)[20:] == pytest.approx(
        0.5 * displacements(times_s, sending(), AT_ONCE)[:-20]
    )


@pytest.mark.parametrize(
    ("frame", "axes", "sentence"),
    [("body", ("vx", "vy"), "has no heading"), ("world", ("vx", "wz"), "no meaning in the world's frame")],
)
def test_what_cannot_be_added_gets_one_sentence(frame, axes, sentence):
    with pytest.raises(MtmError, match=sentence):
        with_message(track(), sending(axes), AT_ONCE, frame)
