import math

import numpy as np
import pytest

from hil.experiments.verdicts.hostile import KINDS, hostile_recording
from hil.experiments.verdicts.validity import decode_under_keys, summarise_validity, validity_cells
from mtm_audit.model.track import FARTHEST


@pytest.mark.parametrize("kind", list(KINDS))
def test_a_hostile_recording_repeats_by_its_number(kind):
    one, again, other = (hostile_recording(kind, number, 5) for number in (0, 0, 1))
    assert all(
        np.array_equal(a.positions, b.positions, equal_nan=True) for a, b in zip(one.tracks, again.tracks, strict=True)
    )
    assert one.tracks[0].positions.shape != other.tracks[0].positions.shape or not np.array_equal(
        one.tracks[0].positions, other.tracks[0].positions, equal_nan=True
    )
    assert one.onset_s is not None
    assert other.onset_s is None


def test_two_of_each_kind_show_all_laws_and_schedules():
    recordings = [hostile_recording(kind, number, 5) for kind in KINDS for number in range(2)]
    shown = {
        (scheme.power, scheme.schedule, scheme.message_symbols, recording.onset_s is None)
        for recording in recordings
        for scheme in (recording.scheme,)
    }
    assert len(shown) == 16


def test_only_rolling_recordings_say_when_they_were_made():
    for number in range(16):
        recording = hostile_recording("sine", number, 5)
        assert (recording.at is None) == (recording.scheme.schedule == "fixed")


def test_impulses_reach_as_far_as_a_track_may():
    assert np.abs(hostile_recording("impulses", 0, 5).tracks[0].positions).max() == FARTHEST


def test_exchanged_robots_are_under_each_other_s_name():
    one, other = hostile_recording("exchanged robots", 0, 5).tracks
    assert (one.name, other.name) == ("robot1", "robot0")


def test_each_recording_gets_all_its_keys():
    cells = validity_cells("sine", 3, 120, 700_000)
    assert len({cell.name for cell in cells}) == 9
    assert sum(int(cell.parameters["keys"]) for cell in cells) == 360


@pytest.mark.parametrize("number", range(8))
def test_keys_on_a_hostile_recording_find_nothing(number):
    asked = {"kind": "comb", "recording": number, "world": 5, "keys": 3}
    result = decode_under_keys(asked, 9)
    assert result == decode_under_keys(asked, 9)
    assert (result["keys"], result["decoded"], result["inconclusive"], result["not_finite"]) == (3, 0, 0, 0)


def cell(**changes):
    usual = dict(
        keys=2, refused=0, decoded=0, inconclusive=0, not_finite=0, sum_e=0.0, sum_e_squared=0.0, symbols=2,
        sum_symbol_e=0.0, sum_symbol_e_squared=0.0, most_nats=-1.0,
    )  # fmt: skip
    return {**usual, "p <= 0.1": 0, "p <= 0.01": 0, "p <= 0.001": 0, **changes}


def test_cells_add_up_to_counts_and_a_mean_with_its_error():
    summary = summarise_validity("x", [
        cell(sum_e=4.0, sum_e_squared=10.0, decoded=1, most_nats=math.log(3.0), **{"p <= 0.1": 1}), cell(refused=1),
    ])  # fmt: skip
    assert (summary.keys, summary.refused, summary.decoded, summary.below) == (4, 1, 1, (1, 0, 0))
    e_values = np.array([3.0, 1.0, 0.0, 0.0])
    assert summary.mean_e == pytest.approx(e_values.mean())
    assert summary.mean_e_error == pytest.approx(e_values.std(ddof=1) / 2.0)
    assert summary.most_bits == pytest.approx(math.log2(3.0))
