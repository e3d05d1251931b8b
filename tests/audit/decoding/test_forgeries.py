"""Forgeries that succeed against one secret and waveforms that come again fail against keys made by default."""

from dataclasses import replace

import pytest

from hil.experiments.verdicts.forgeries import ATTACKS, COUNTS, HONEST, forgery_cells, one_try, try_forgeries
from mtm_audit.decoding.decode import decode_tracks
from mtm_audit.decoding.settings import DecodeSettings
from tests.audit.moving_robot import key_of, robot_track, scheme_of


def test_honest_robots_are_authenticated():
    assert one_try(HONEST, 0) == ("decoded", "authenticated")


@pytest.mark.parametrize("attack", ATTACKS)
@pytest.mark.parametrize("seed", range(2))
def test_a_forgery_is_not_authenticated(attack, seed):
    assert "authenticated" not in one_try(attack, seed)


@pytest.mark.parametrize("seed", range(6))
def test_a_robot_whose_part_the_code_fills_in_is_not_vouched_for(seed):
    # The code may fill in what another robot would have said; the report then does not call it authenticated.
    assert "authenticated" not in one_try("one robot as another", seed)


def test_cells_hold_every_attack_and_the_control():
    cells = forgery_cells(100, 0)
    assert sum(int(cell.parameters["tries"]) for cell in cells if cell.parameters["attack"] != HONEST) >= 100
    assert {cell.parameters["attack"] for cell in cells} == {HONEST, *ATTACKS}


def test_a_cell_counts_what_became_of_its_films(monkeypatch):
    answers = iter([("decoded", "authenticated"), ("absent",), ("refused",), ("decoded",), ("inconclusive",)])
    monkeypatch.setattr("hil.experiments.verdicts.forgeries.one_try", lambda attack, seed: next(answers))
    counts = try_forgeries({"attack": HONEST, "tries": 5}, 0)
    assert [counts[name] for name in COUNTS] == [5, 2, 1, 1, 1, 1]


def test_under_a_fixed_schedule_a_splice_reads_as_a_message():
    # What default keys are measured against: the same attack on the paper's schedule.
    key = key_of(scheme_of(symbols=(2,), ticks=400))
    heard = [robot_track(key, "robot0", symbols, 18.0, onset_s=0.0, seed=1) for symbols in ((0, 1), (2, 3))]
    first, second = heard
    half = round(4.0 * 100)
    steps = [track.positions[1:] - track.positions[:-1] for track in heard]
    spliced = first.positions.copy()
    for place in range(half, len(spliced)):
        # In each message's second half, the second robot's motion of that half.
        source = steps[1] if place // half % 2 else steps[0]
        spliced[place] = spliced[place - 1] + source[place - 1]
    decoding = decode_tracks([replace(second, positions=spliced)], key, DecodeSettings(onset_s=0.0))
    assert (decoding.verdict, decoding.symbols) == ("decoded", (0, 3))
