import numpy as np
import pytest

from hil.experiments.detectors.linear_genie import (
    GenieKnowledge,
    axis_motion,
    fit_interference,
    genie_scores,
    moved_by_responses,
)
from hil.experiments.real.added import with_message
from hil.fleet.sending import Sending
from hil.plants.linear_response import LinearResponse
from mtm_audit.detectors.matched.motion import Motion
from mtm_onboard.protocol import Channel, Key, Scheme
from tests.hil.experiments.real.test_rollout import spinning_track


def sending(axes, symbols=(5,), sigma=0.05):
    channel = Channel("robot", "robot", axes, len(symbols), sigma)
    scheme = Scheme(
        name="fake", rate_hz=50.0, band_hz=(0.5, 4.0), alphabet_size=8, message_ticks=100 * len(symbols),
        channels=(channel,),
    )  # fmt: skip
    codebook = Key("fake", bytes(32), scheme).codebook()
    return Sending(
        codebook=codebook, channel=channel, symbols=symbols, onset_s=0.7, messages=99, sigma=sigma, rate_scale=1.001
    )


def knowledge(silent, played, responses):
    motion = axis_motion(silent, played.channel.axes, 4.0, body=True)
    return GenieKnowledge(moved_by_responses(played, responses), tuple(fit_interference([motion], a) for a in (0, 1)))


def genie_symbols(*given):
    return np.argmax(genie_scores(*given), axis=1)


@pytest.mark.parametrize("axes", [("vx", "vy"), ("vx", "wz")])
def test_the_genie_reads_body_axes_of_a_robot_that_turns(axes):
    silent, played = spinning_track(), sending(axes, (5, 2, 7))
    responses = {axis: LinearResponse(delay_s=0.1, natural_hz=2.0) for axis in axes}
    seen = axis_motion(with_message(silent, played, responses, "body"), axes, 4.0, body=True)
    found = genie_symbols(seen, played, knowledge(silent, played, responses), 9)
    assert found.tolist() == [5, 2, 7] * 3
    other = {axis: LinearResponse(delay_s=1.0, natural_hz=2.0) for axis in axes}
    assert genie_symbols(seen, played, knowledge(silent, played, other), 9).tolist() != [5, 2, 7] * 3


def test_the_genie_looks_at_nothing_where_nothing_was_seen():
    silent, played = spinning_track(), sending(("vx", "vy"))
    responses = {axis: LinearResponse() for axis in ("vx", "vy")}
    seen = axis_motion(with_message(silent, played, responses, "body"), ("vx", "vy"), 4.0, body=True)
    hidden = np.arange(len(seen.seen)) < 60
    velocities = np.where(hidden, 1000.0, seen.velocities)
    known = knowledge(silent, played, responses)
    found = genie_symbols(Motion(seen.start_s, seen.step_s, velocities, seen.seen & ~hidden), played, known, 9)
    assert found[3:].tolist() == [5] * 6


def test_interference_under_a_strong_course_is_found():
    draw = np.random.default_rng(4)
    course = np.cumsum(np.cumsum(draw.standard_normal(2000))) * 1e-3
    motion = Motion(0.0, 0.05, (course + 0.01 * draw.standard_normal(2000))[None, :], np.ones(2000, bool))
    assert fit_interference([motion], 0).scales[0] < 0.03
