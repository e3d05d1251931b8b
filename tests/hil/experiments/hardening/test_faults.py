"""A few cells of the fault matrix from end to end, and how an outcome is judged."""

import csv
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console

from hil.commands.faults import faults
from hil.experiments.hardening import faults as experiment
from hil.experiments.hardening.fault_run import END_S, LOST_S, SILENT_S, START_S, FaultRun
from hil.experiments.hardening.faults import (
    FAULTS,
    LOSSES,
    WIRES,
    Outcome,
    Row,
    assess,
    fault_cell,
    fault_cells,
    row_of,
)
from hil.experiments.runs.cells import Cell, CellStore
from mtm_onboard.model.velocity import STOP, BodyVelocity
from mtm_onboard.protocol.journal_file import NOISE, UNSENT, JournalHeader, JournalRecord

FINE = Outcome(
    altered=0,
    arrived_s=0.02,
    held_s=0.2,
    lost_stop_s=0.2,
    silent_stop_s=0.27,
    losses=1,
    windows=8,
    sent=6,
    message_is_due=True,
    is_decoded=True,
    p_value=1e-6,
)


def measured(wire: str, fault: str, loss: str) -> Row:
    cell = Cell("faults", {"wire": wire, "fault": fault, "loss": loss}, 3)
    return row_of(cell, fault_cell(cell.parameters, cell.seed))


@pytest.mark.parametrize(
    ("wire", "fault", "loss"),
    [("can", "corrupt", "cut"), ("plaintext", "delay", ""), ("mavlink", "block", "swallowed")],
)
def test_under_fault_and_loss_the_robot_stops_and_is_read(wire, fault, loss):
    line = measured(wire, fault, loss)
    assert (line.stops, line.is_fresh, line.is_read) == (True, True, True)
    assert (line.outcome.is_decoded, line.outcome.altered) == (True, 0)
    assert line.outcome.sent >= 4


def test_without_a_deadman_a_cut_robot_stops_in_half_a_second(monkeypatch):
    monkeypatch.setattr(experiment, "_decoded", lambda *_: {"is_decoded": True, "p_value": 0.0})
    line = measured("plaintext", "none", "cut")
    assert line.lost_deadline_s is None
    assert line.outcome.lost_stop_s == -1.0
    assert 5.0 < line.outcome.held_s < 5.6


def recorded(sent, flags=NOISE) -> JournalRecord:
    """A journal of ticks from tick 0 on."""
    count = len(sent)
    header = JournalHeader(
        fingerprint="0" * 16,
        key_id="fake-key",
        robot="robot0",
        channel="robot0",
        symbols=(3, 1),
        repeat=True,
        rate_hz=50.0,
        start_s=START_S,
        start_unix_s=None,
    )
    nothing = np.zeros((count, 3))
    return JournalRecord(
        header=header,
        ticks=np.arange(count),
        times_s=np.arange(count) / 50.0,
        base=nothing,
        sent=np.asarray(sent, float),
        lateness_s=np.zeros(count),
        flags=np.full(count, flags),
        damaged=0,
    )


def run_of(*in_force, sent=None, flags=NOISE) -> FaultRun:
    """Those commands in force, and a journal in which every tick's speed is another."""
    each = np.column_stack([np.arange(1700) / 1e3, np.zeros((1700, 2))]) if sent is None else sent
    return FaultRun(in_force, np.zeros((0, 3)), recorded(each, flags), 1)


def command(tick: int) -> BodyVelocity:
    return BodyVelocity(tick / 1e3, 0.0, 0.0)


def test_the_age_of_a_command_counts_from_when_it_was_sent():
    result = assess(run_of((2.8, command(100)), (3.5, STOP)), False)  # tick 100 was at 2.5 s
    assert (result["arrived_s"], result["held_s"], result["altered"]) == (0.3, 1.0, 0)


def test_a_command_that_was_never_sent_is_counted():
    assert assess(run_of((2.0, BodyVelocity(0.1, 0.2, 0.0)), (2.1, STOP)), False)["altered"] == 1


@pytest.mark.parametrize(("stopped_s", "expected_s"), [(LOST_S + 0.2, 0.2), (SILENT_S, -1.0)])
def test_the_stop_after_a_loss_counts_from_the_loss(stopped_s, expected_s):
    run = run_of((2.0, command(75)), (stopped_s, STOP))
    assert assess(run, True)["lost_stop_s"] == expected_s
    assert assess(run, False)["lost_stop_s"] == 0.0


def test_the_stop_after_the_last_command_ends_all_motion():
    run = run_of((2.0, command(75)), (SILENT_S, STOP), (36.0, command(75)), (36.5, STOP))
    assert assess(run, False)["silent_stop_s"] == pytest.approx(36.5 - (SILENT_S - 0.02))
    assert assess(run_of((2.0, command(75))), False)["silent_stop_s"] == pytest.approx(END_S - (SILENT_S - 0.02))


@pytest.mark.parametrize(("flags", "sent", "due"), [(NOISE, 8, True), (NOISE | UNSENT, 0, False), (0, 0, False)])
def test_windows_count_as_sent_when_their_noise_has_left(flags, sent, due):
    result = assess(run_of((2.0, command(75)), (2.1, STOP), flags=flags), False)
    assert (result["windows"], result["sent"], result["message_is_due"]) == (8, sent, due)


def test_a_window_that_the_robot_cannot_follow_was_not_sent():
    sent = np.column_stack([np.repeat([0.3, 0.2], 850), np.zeros((1700, 2))])
    result = assess(run_of((2.0, BodyVelocity(0.2, 0.0, 0.0)), (2.1, STOP), sent=sent), False, most=0.25)
    assert (result["windows"], result["sent"], result["message_is_due"]) == (8, 4, True)


def judged(wire: str = "can", loss: str = "cut", **changes) -> Row:
    cell = Cell("faults", {"wire": wire, "fault": "none", "loss": loss}, 0)
    return row_of(cell, vars(replace(FINE, **changes)))


@pytest.mark.parametrize(
    ("changes", "verdicts"),
    [
        ({}, (True, True, True)),
        ({"silent_stop_s": 0.3}, (False, True, True)),
        ({"lost_stop_s": 0.25}, (False, True, True)),
        ({"lost_stop_s": -1.0}, (False, True, True)),
        ({"wire": "plaintext", "lost_stop_s": -1.0}, (True, True, True)),
        ({"arrived_s": 0.26}, (True, False, True)),
        ({"is_decoded": False}, (True, True, False)),
        ({"is_decoded": False, "message_is_due": False}, (True, True, True)),
    ],
)
def test_a_line_is_judged_by_its_deadlines(changes, verdicts):
    line = judged(**changes)
    assert (line.stops, line.is_fresh, line.is_read) == verdicts


def test_the_matrix_has_every_fault_loss_and_wire():
    assert len(fault_cells(2, 0)) == 2 * len(WIRES) * len(FAULTS) * len(LOSSES) == 162


def test_the_table_comes_from_the_cells_and_tells_a_bad_one(tmp_path, capsys):
    cells, out = tmp_path / "cells.jsonl", tmp_path / "faults.csv"
    with CellStore(cells) as store:
        for cell in fault_cells(1, 0):
            bad = cell.parameters == {"wire": "can", "fault": "drop", "loss": ""}
            store.add(cell, vars(replace(FINE, silent_stop_s=0.5 if bad else 0.27)))
    assert not faults(1, 0, 1, out, cells, Console())
    assert "81 runs, 1 of them failed" in capsys.readouterr().out
    with out.open() as file:
        assert next(file).startswith("# mtm-hil faults -n 1 --seed 0 --out ")
        assert next(file).startswith("# code ")
        rows = list(csv.DictReader(file))
    assert [row["fault"] for row in rows if row["stops"] == "False"] == ["drop"]
    assert {row["lost_deadline_s"] for row in rows if row["wire"] == "plaintext"} == {"none"}
