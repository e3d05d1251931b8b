"""Forgeries that succeed against one secret and waveforms that come again fail against keys made by default."""

from dataclasses import replace
from datetime import UTC, datetime

import numpy as np
import pytest

from hil.experiments.verdicts.forgeries import (
    CONTROL,
    COUNTS,
    FORGED,
    filmed,
    forgery_cells,
    one_try,
    shows_a_right_tag,
    try_forgeries,
)
from hil.experiments.verdicts.forgers import ATTACKS, ERROR_S, ONE_ROBOT, Fleet, holder_of
from mtm_audit.decoding.decode import decode_tracks
from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.model.recorded_at import RecordedAt
from mtm_onboard.protocol.slots import slot_at
from tests.audit.moving_robot import key_of, robot_track, scheme_of

UNDER_DEFAULT_KEYS = [name for name, attack in ATTACKS.items() if attack.control_scheme.schedule == "rolling"]


@pytest.mark.parametrize("attack", UNDER_DEFAULT_KEYS)
def test_the_same_done_rightly_is_authenticated(attack):
    assert "authenticated" in one_try(attack, CONTROL, 0)


@pytest.mark.parametrize("attack", sorted(set(ATTACKS) - set(UNDER_DEFAULT_KEYS)))
def test_under_a_fixed_schedule_it_is_decoded(attack):
    assert one_try(attack, CONTROL, 0) == ("decoded",)


@pytest.mark.parametrize("attack", ATTACKS)
@pytest.mark.parametrize("seed", range(2))
def test_a_forgery_is_not_authenticated(attack, seed):
    assert "authenticated" not in one_try(attack, FORGED, seed)


@pytest.mark.parametrize("seed", range(2, 5))
def test_a_robot_whose_part_the_code_fills_in_is_not_vouched_for(seed):
    # The code may fill in what another robot would have said; the report then does not call it authenticated.
    assert "authenticated" not in one_try("one robot as another", FORGED, seed)


@pytest.mark.parametrize(("attack", "right"), [("replay", False), ("splice", False), ("honest", True)])
def test_the_short_check_says_what_a_whole_decode_says(attack, right):
    draw = np.random.default_rng(11)
    slot = slot_at(datetime(2026, 11, 30, 10, tzinfo=UTC).timestamp(), ONE_ROBOT)
    fleet = Fleet(holder_of(0, ONE_ROBOT), ONE_ROBOT, slot, draw)
    film = ATTACKS["replay"].control(fleet) if attack == "honest" else ATTACKS[attack].forge(fleet)
    track = filmed("robot0", film.noise[0], draw)
    at = RecordedAt(film.began_unix_s, ERROR_S)
    frames = decode_tracks([track], fleet.key, DecodeSettings(at=at)).frames
    assert any(frame.message.authenticated for frame in frames) == right
    assert shows_a_right_tag(track, fleet.key, at) == right


def test_cells_hold_every_attack_and_its_control():
    cells = forgery_cells(1000, 0)
    tries = {
        role: {
            name: sum(
                int(cell.parameters["tries"])
                for cell in cells
                if (cell.parameters["attack"], cell.parameters["role"]) == (name, role)
            )
            for name in ATTACKS
        }
        for role in (FORGED, CONTROL)
    }
    assert sum(tries[FORGED].values()) >= 1000
    assert min(tries[FORGED].values()) >= 1000 // 16
    assert min(tries[CONTROL].values()) >= 1
    assert len({cell.name for cell in cells}) == len(cells)


def test_a_cell_counts_what_became_of_its_films(monkeypatch):
    whole = ("right tags", "decoded", "authenticated")
    answers = iter([whole, (), ("refused",), ("decoded",), ("right tags",)])
    monkeypatch.setattr("hil.experiments.verdicts.forgeries.one_try", lambda *_: next(answers))
    counts = try_forgeries({"attack": "splice", "role": FORGED, "tries": 5}, 0)
    assert [counts[name] for name in COUNTS] == [5, 2, 2, 1, 1]


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
