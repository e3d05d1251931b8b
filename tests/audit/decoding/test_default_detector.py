"""What the default detector must never call decoded, and what it must not call absent."""

import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy import stats

from hil.sensors.motion_capture import write_tum
from mtm_audit.cli import main
from mtm_audit.decoding.decode import decode_tracks
from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.model.recording import Recording
from mtm_audit.model.track import Track
from mtm_audit.reporting.remarks import remarks
from mtm_onboard.protocol import save_key
from tests.audit.decoding.strange_robots import differential, legged, saturating, strange_track
from tests.audit.detectors.matched.fleet_motion import fleet_run
from tests.audit.moving_robot import key_of, robot_track, scheme_of

SEEDS = (1, 2)


def fleet(seed):
    """Four robots of the fleet preset that send a symbol each, twice."""
    return fleet_run(seed, 300, 14.0)


def decoded(run, tracks, **settings):
    return decode_tracks(tracks, run.key, DecodeSettings(**settings))


def told(tracks, decoding):
    return remarks(Recording((Path("fleet.tum"),), "motion capture", tuple(tracks)), decoding)


def with_track(tracks, place, other):
    """The tracks with `other` under the name of the one at that place."""
    return [replace(other, name=track.name) if row == place else track for row, track in enumerate(tracks)]


@pytest.mark.parametrize("seed", SEEDS)
def test_a_silent_robot_of_a_fleet_is_named_and_not_read(seed):
    run, quiet = fleet(seed), fleet_run(seed + 50, 300, 14.0, sends=False)
    tracks = with_track(run.tracks, 1, quiet.tracks[1])
    decoding = decoded(run, tracks)
    assert (decoding.verdict, decoding.message) == ("inconclusive", None)
    assert decoding.uncertain == (1,)
    assert [channel.state for channel in decoding.channels] == ["read", "silent", "read", "read"]
    warnings = told(tracks, decoding)
    assert any("robot1 does not show its channel" in warning for warning in warnings)
    assert not any("robot0" in warning or "robot2" in warning or "robot3" in warning for warning in warnings)


@pytest.mark.parametrize(("one", "other"), [(0, 1), (1, 3)])
def test_exchanged_tracks_are_read_and_the_exchange_is_told(one, other):
    run = fleet(1)
    tracks = with_track(with_track(run.tracks, one, run.tracks[other]), other, run.tracks[one])
    decoding = decoded(run, tracks)
    assert (decoding.verdict, decoding.symbols) == ("decoded", run.symbols)
    assert f"robot{one} and robot{other} are exchanged" in " ".join(told(tracks, decoding))
    assert [channel.exchanged for channel in decoding.channels] == [place in (one, other) for place in range(4)]


def test_tracks_assigned_the_wrong_way_are_read_and_it_is_told():
    run = fleet(2)
    decoding = decoded(run, run.tracks, assignment={"robot0": "robot2", "robot2": "robot0"})
    assert (decoding.verdict, decoding.symbols) == ("decoded", run.symbols)
    warnings = told(run.tracks, decoding)
    for body in ("robot0", "robot2"):
        assert f"{body} is the track {body}, though it was assigned another: its motion is there" in warnings
    # Each is in the track of its own name; what said otherwise was the assignment.
    assert not any("names say otherwise" in warning for warning in warnings)


@pytest.mark.parametrize("seed", SEEDS)
def test_two_robots_that_play_one_channel_are_told(seed):
    run = fleet(seed)
    beside = replace(run.tracks[0], positions=run.tracks[0].positions + np.array([1.0, 1.0]))
    tracks = with_track(run.tracks, 2, beside)
    decoding = decoded(run, tracks)
    assert (decoding.verdict, decoding.message) == ("inconclusive", None)
    assert decoding.uncertain == (2,)
    assert decoding.channels[2].also_shows == "robot0"
    assert "robot2 does not show its channel" in " ".join(told(tracks, decoding))


def briefly(track, first_s, last_s):
    shown = (track.times_s > first_s) & (track.times_s < last_s)
    headings_rad = None if track.headings_rad is None else track.headings_rad[shown]
    return replace(
        track, times_s=track.times_s[shown], positions=track.positions[shown], valid=track.valid[shown],
        headings_rad=headings_rad,
    )  # fmt: skip


@pytest.mark.parametrize("seed", SEEDS)
def test_a_robot_seen_for_a_tenth_of_the_time_is_named(seed):
    run = fleet_run(seed, 600, 26.0)
    tracks = with_track(run.tracks, 3, briefly(run.tracks[3], 6.0, 8.5))
    decoding = decoded(run, tracks)
    assert (decoding.verdict, decoding.message) == ("inconclusive", None)
    assert decoding.uncertain == (3,)
    assert decoding.symbols[:3] == run.symbols[:3]
    assert any("robot3" in warning for warning in told(tracks, decoding))


def test_a_track_too_short_for_a_window_stops_no_other():
    run = fleet(1)
    tracks = with_track(run.tracks, 2, briefly(run.tracks[2], 1.5, 3.0))
    decoding = decoded(run, tracks, onset_s=1.5)
    assert (decoding.verdict, decoding.message) == ("inconclusive", None)
    assert decoding.symbols == (*run.symbols[:2], None, run.symbols[3])
    assert decoding.channels[2].state == "too short"
    assert any("third of a window" in warning and "robot2" in warning for warning in told(tracks, decoding))


LARGE = scheme_of(symbols=(8,), ticks=800, alphabet=256)


@pytest.mark.parametrize(
    ("follow", "onset_s"), [(saturating, 0.4), (differential, 0.4), (differential, None), (legged, None)]
)
def test_plants_outside_the_family_are_never_read_wrong(follow, onset_s):
    key, sent = key_of(LARGE), tuple(np.random.default_rng(3).integers(0, 256, 8).tolist())
    track = strange_track(key, "robot0", sent, 17.2, follow, seed=3)
    decoding = decode_tracks([track], key, DecodeSettings(onset_s=onset_s))
    assert decoding.verdict != "decoded" or decoding.symbols == sent
    if onset_s is not None:
        sure = [place for place in range(8) if place not in decoding.uncertain]
        assert [decoding.symbols[place] for place in sure] == [sent[place] for place in sure]


TIMES_S = np.arange(501) / 100.0
PATHS = {
    "line": np.stack([0.2 * TIMES_S, 0.1 * TIMES_S], axis=1),
    "sine": np.stack([0.3 * np.sin(4.4 * TIMES_S), 0.2 * np.cos(4.4 * TIMES_S)], axis=1),
    "quick sine": 0.05 * np.stack([np.sin(12.6 * TIMES_S), np.sin(15.7 * TIMES_S)], axis=1),
    "still": np.zeros((501, 2)),
}


@pytest.mark.parametrize("path", PATHS)
def test_noise_free_paths_hold_no_message_of_any_key(path):
    scheme, track = scheme_of(symbols=(1,), ticks=200), Track("robot0", TIMES_S, PATHS[path], np.ones(501, bool))
    p_values = []
    for number in range(24):
        key = key_of(scheme, b"fake secret of no robot " + number.to_bytes(8, "big"))
        decoding = decode_tracks([track], key, DecodeSettings(onset_s=0.4 if number % 2 else None))
        assert (decoding.verdict, decoding.message) == ("absent", None)
        p_values.append(decoding.evidence.p_value)
    for share in (0.1, 0.01):
        assert np.sum(np.array(p_values) <= share) <= stats.binom.isf(0.001, len(p_values), share)


ONE = key_of(scheme_of(symbols=(1,), ticks=300))


@cache
def one_robot():
    return robot_track(ONE, "robot0", (2,), 26.0, onset_s=1.0)


@pytest.mark.parametrize("far_m", [30.0, 1e3, -1e6])
def test_one_wild_sample_costs_a_warning_and_no_more(far_m):
    track = one_robot()
    positions = track.positions.copy()
    positions[1200, 0] += far_m
    tracks = [replace(track, positions=positions)]
    decoding = decode_tracks(tracks, ONE, DecodeSettings())
    clean = decode_tracks([track], ONE, DecodeSettings())
    assert (decoding.verdict, decoding.symbols) == ("decoded", (2,))
    assert decoding.evidence.nats > 0.9 * clean.evidence.nats
    assert any("robot0" in warning and "leap" in warning for warning in told(tracks, decoding))
    assert told([track], clean) == ()


@pytest.mark.parametrize("place", [0, 1, 2599, 2600])
def test_a_wild_sample_at_either_end_is_left_out_too(place):
    track = one_robot()
    positions = track.positions.copy()
    positions[place] += 50.0
    decoding = decode_tracks([replace(track, positions=positions)], ONE, DecodeSettings(onset_s=1.0))
    assert (decoding.verdict, decoding.symbols) == ("decoded", (2,))


def test_p_near_the_limit_is_warned_of_alike_in_text_and_json(tmp_path, capsys):
    save_key(ONE, tmp_path / "robot.key")
    write_tum(replace(one_robot(), headings_rad=np.zeros(len(one_robot().times_s))), tmp_path / "robot0.tum")
    asked = ["decode", str(tmp_path / "robot0.tum"), "--key", str(tmp_path / "robot.key"), "--onset", "1"]

    def answer(*more):
        with pytest.raises(SystemExit) as left:
            main([*asked, "--threshold", "1e-250", *more])
        return left.value.code, capsys.readouterr().out

    (code, text), (same_code, written) = answer(), answer("--json")
    report = json.loads(written)
    assert code == same_code == 3
    assert 1e-250 < report["p_value"] <= 0.01
    assert any("do not take it for absent" in warning for warning in report["warnings"])
    shown = [line.removeprefix("warning: ") for line in text.splitlines() if line.startswith("warning: ")]
    unbroken = " ".join(text.split())
    assert len(shown) == len(report["warnings"])
    assert all(f"warning: {warning}" in unbroken for warning in report["warnings"])
