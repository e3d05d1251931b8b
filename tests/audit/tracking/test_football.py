import cv2
import numpy as np
import pytest

from mtm_audit.model.picture import Frame
from mtm_audit.model.track import Track
from mtm_audit.tracking.football import FootballTracker, without_jumps
from mtm_audit.tracking.registry import tracker
from mtm_onboard.protocol import MtmError

FRAMES = 90
KICK_OFFS = (30, 61)
GREEN_BGR, RED_BGR = (64, 191, 64), (28, 26, 227)
TEAM_BGR = ((255, 255, 0), (255, 0, 255), (0, 255, 255))


def walks(count=3, seed=1):
    """Own motion (FRAMES, count, 2) in pixels, y up, of agents that start anywhere and turn smoothly."""
    rng = np.random.default_rng(seed)
    phases, starts = rng.uniform(0, 6, (2, count)), np.array([[70, 75], [150, 220], [230, 110]])[:count]
    instants = np.arange(FRAMES)[:, None]
    motion = np.stack([20 * np.sin(0.1 * instants + phases[0]), 15 * np.sin(0.13 * instants + phases[1])], axis=2)
    return starts + motion


def kicked_off(walk):
    """The same with each put to where the next one was at every kick-off."""
    places = walk.copy()
    for frame in KICK_OFFS:
        places[frame:] += np.roll(places[frame - 1], 1, axis=0) - places[frame - 1]
    return places


def match(places, hidden=(), team=TEAM_BGR):
    """A match on green with a red opponent and a black ball; `hidden` frames show the pitch alone."""
    for number, own in enumerate(places):
        image = np.full((300, 300, 3), GREEN_BGR, np.uint8)
        cv2.circle(image, (20, 20), 7, RED_BGR, -1, cv2.LINE_AA)
        cv2.circle(image, (280, 280), 6, (38, 38, 38), -1, cv2.LINE_AA)
        for (x, y), bgr in zip(own if number not in hidden else (), team, strict=False):
            cv2.circle(image, (round(x * 16), round((299 - y) * 16)), 7 * 16, bgr, -1, cv2.LINE_AA, 4)
        yield Frame(number / 10, image)


def steps(positions):
    return np.diff(positions, axis=0)


def test_a_team_is_tracked_by_its_colours_on_green():
    walk = walks()
    tracks = tracker("football").track(match(walk))
    assert [track.name for track in tracks] == ["agent0", "agent1", "agent2"]
    for number, track in enumerate(tracks):
        assert track.valid.all()
        assert np.abs(track.positions - walk[:, number]).max() < 0.6


def test_kick_offs_are_taken_out_and_agents_own_motion_stays():
    walk = walks()
    places = kicked_off(walk)
    assert np.abs(steps(places)).max() > 20
    for number, track in enumerate(FootballTracker().track(match(places))):
        error = steps(track.positions) - steps(walk[:, number])
        assert track.valid.all()
        assert np.abs(np.delete(error, np.array(KICK_OFFS) - 1, axis=0)).max() < 0.6
        assert np.abs(error).max() < 1.5


def test_a_hidden_agent_is_missing_and_its_way_counts():
    walk = walks()
    for number, track in enumerate(FootballTracker().track(match(walk, hidden=range(40, 47)))):
        assert np.array_equal(np.flatnonzero(~track.valid), np.arange(40, 47))
        assert np.isnan(track.positions[40:47]).all()
        assert np.abs(track.positions - walk[:, number])[track.valid].max() < 0.6


def test_an_agent_that_another_covers_in_part_is_missing():
    walk = walks(2)
    walk[:, 1] = walk[:, 0] + np.stack([np.linspace(-60, 60, FRAMES), np.full(FRAMES, 6.0)], axis=1)
    under, over = FootballTracker(("cyan", "magenta")).track(match(walk))
    assert over.valid.all()
    assert 3 < np.sum(~under.valid) < 20
    assert np.abs(under.positions - walk[:, 0])[under.valid].max() < 1.2


def test_chosen_colours_number_the_agents_in_their_order():
    walk = walks(2)
    tracks = tracker("football:yellow, cyan").track(match(walk, team=(TEAM_BGR[2], TEAM_BGR[0])))
    assert [track.name for track in tracks] == ["agent0", "agent1"]
    for number, track in enumerate(tracks):
        assert np.abs(track.positions - walk[:, number]).max() < 0.6


def track_of(positions):
    positions = np.asarray(positions, dtype=np.float64)
    valid = np.isfinite(positions[:, 0])
    return Track("agent0", np.arange(len(positions)) / 10, positions, valid, unit="px")


def test_a_body_that_starts_moving_and_gets_fast_has_not_jumped():
    speeds = np.concatenate([np.zeros(20), np.linspace(0, 12, 20), np.full(20, 12.0)])
    track = track_of(np.stack([np.cumsum(speeds), np.zeros(60)], axis=1))
    assert np.array_equal(without_jumps(track).positions, track.positions)


def test_a_single_wrong_sighting_is_taken_out_there_and_back():
    line = np.stack([2.0 * np.arange(40), np.zeros(40)], axis=1)
    wrong = line.copy()
    wrong[20] += 90
    assert np.allclose(without_jumps(track_of(wrong)).positions, line)


def test_a_jump_while_hidden_is_taken_out_too():
    line = np.stack([2.0 * np.arange(40), np.zeros(40)], axis=1)
    hidden = line.copy()
    hidden[20:] += [0, 120]
    hidden[15:22] = np.nan
    cleaned = without_jumps(track_of(hidden))
    assert np.allclose(cleaned.positions[cleaned.valid], line[cleaned.valid])


@pytest.mark.parametrize("name", ["football:mauve-ish", "football:red,,blue", "football:#808080"])
def test_a_colour_that_is_none_is_refused(name):
    with pytest.raises(MtmError, match="no colour|too gray"):
        tracker(name)


def test_a_match_without_the_team_is_refused():
    with pytest.raises(MtmError, match="none of cyan, magenta, yellow found in 90 frames"):
        tracker("football").track(match(walks(), hidden=range(FRAMES)))


def test_a_picture_that_changes_its_size_is_refused():
    frames = [Frame(0.0, np.zeros((96, 128, 3), np.uint8)), Frame(0.1, np.zeros((128, 96, 3), np.uint8))]
    with pytest.raises(MtmError, match="from 128 x 96 to 96 x 128"):
        tracker("football").track(frames)
