import csv
import io

import pytest
from rich.console import Console

from hil.experiments.detectors.paper_robomaster import measure, rich_table, write_csv
from hil.experiments.detectors.robomaster_rollout import NO_MESSAGE, SENT, WRONG_KEY, decode_rollout, rollout_parameters
from hil.experiments.runs.cells import CellStore
from hil.experiments.runs.proportion import Proportion
from hil.plants.mecanum import calibrated_parameters

QUIET = Console(file=io.StringIO(), width=100)


@pytest.fixture(scope="module")
def rows(tmp_path_factory):
    conditions = [(SENT, 400), (WRONG_KEY, 400), (NO_MESSAGE, 400)]
    with CellStore(tmp_path_factory.mktemp("cells") / "cells.jsonl") as store:
        return measure(calibrated_parameters(), 3, store, QUIET, conditions=conditions, workers=1)


def test_with_the_key_nearly_all_symbols_come_through(rows):
    sent, wrong, silent = rows
    assert (sent.symbols.trials, wrong.symbols.trials, silent.symbols.trials) == (12, 120, 12)
    assert sent.symbols.successes >= 10
    assert 12 <= wrong.symbols.successes <= 48
    assert silent.symbols.successes <= 8
    assert sent.margin > 0.1 > 0.02 > max(wrong.margin, silent.margin)


def test_a_message_counts_when_all_four_symbols_do(rows):
    assert rows[0].messages is not None
    assert rows[0].messages.trials == 3
    assert rows[1].messages is rows[2].messages is None


def test_a_rollout_repeats_under_its_seed_alone():
    parameters = rollout_parameters(SENT, 200, calibrated_parameters())
    assert decode_rollout(parameters, 5) == decode_rollout(parameters, 5) != decode_rollout(parameters, 6)


def test_the_file_begins_with_the_command_and_fits_the_rows(rows, tmp_path):
    write_csv(tmp_path / "a.csv", rows, "mtm-hil paper robomaster -n 3", ("a plant",))
    first, _, second, *lines = (tmp_path / "a.csv").read_text().splitlines()
    assert (first, second) == ("# mtm-hil paper robomaster -n 3", "# a plant")
    read = list(csv.DictReader(lines))
    assert [row["arm"] for row in read] == ["message", "wrong key", "no message"]
    assert float(read[0]["margin"]) == pytest.approx(rows[0].margin, abs=1e-4)
    assert (read[0]["paper_message_percent"], read[1]["message_percent"]) == ("95", "")
    assert float(read[0]["symbol_percent_low"]) == pytest.approx(rows[0].symbols.interval_percent[0], abs=0.01)


def test_the_table_fits_80_columns_and_shows_the_paper_s_figures(rows):
    console = Console(file=io.StringIO(), width=80)
    console.print(rich_table(rows))
    text = console.file.getvalue()
    assert "0.239" in text
    assert "25.25" in text
    assert "…" not in text


def test_a_proportion_has_an_exact_interval():
    assert Proportion(20, 20).percent == 100.0
    assert Proportion(20, 20).interval_percent == pytest.approx((83.16, 100.0), abs=0.01)
