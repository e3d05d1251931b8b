import csv

import pytest

from hil.cli import main
from hil.experiments.runs.proportion import Proportion
from hil.experiments.worlds.points import headline_point, paper_entries
from hil.experiments.worlds.report import against_the_paper
from hil.experiments.worlds.rollout import NO_MESSAGE
from hil.experiments.worlds.tables import Effort, Row, conditions_of, shortest_ticks


def table_of(path):
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(line for line in file if not line.startswith("#")))


@pytest.fixture(scope="module")
def quick_table(tmp_path_factory):
    folder = tmp_path_factory.mktemp("lander")
    cells, out = folder / "cells.jsonl", folder / "lander.csv"
    with pytest.raises(SystemExit) as leaving:
        main(["paper", "lunar-lander", "--quick", "--workers", "1", "--cells", str(cells), "--out", str(out)])
    assert leaving.value.code in (0, None)
    return table_of(out), cells


@pytest.mark.slow
def test_a_quick_look_at_the_lander_reads_the_headline(quick_table):
    table, _ = quick_table
    for detector in ("coherency", "matched"):
        (row,) = [
            row for row in table
            if (row["arm"], row["detector"], row["message_ticks"]) == ("message", detector, "288")
        ]  # fmt: skip
        assert (row["messages"], row["paper_message_percent"]) == ("8", "100")
        assert int(row["messages_correct"]) >= 7


@pytest.mark.slow
def test_a_video_file_in_between_changes_no_message(quick_table):
    table, _ = quick_table
    for detector in ("coherency", "matched"):
        right = {
            row["arm"]: row["messages_correct"] for row in table
            if row["detector"] == detector and row["message_ticks"] == "288"
        }  # fmt: skip
        assert right["from a file"] == right["message"]


@pytest.mark.slow
def test_wrong_keys_and_silence_read_no_more_than_chance(quick_table):
    table, _ = quick_table
    for row in table:
        if row["arm"] in ("wrong key", "no message"):
            assert float(row["symbol_percent_low"]) <= 12.5 <= float(row["symbol_percent_high"])


@pytest.mark.slow
def test_a_second_look_computes_nothing_again(quick_table, tmp_path, monkeypatch):
    table, cells = quick_table
    before = cells.read_bytes()
    out = tmp_path / "again.csv"
    with pytest.raises(SystemExit):
        main(["paper", "lunar-lander", "--quick", "--workers", "1", "--cells", str(cells), "--out", str(out)])
    assert cells.read_bytes() == before
    assert table_of(out) == table


def test_a_renderer_that_does_not_exist_is_refused(capsys):
    with pytest.raises(SystemExit) as leaving:
        main(["paper", "reacher", "--quick", "--renderer", "crayon"])
    assert leaving.value.code == 2
    assert "'crayon' is not one of" in capsys.readouterr().err


def test_all_rollouts_of_the_headline_are_asked_for():
    conditions = conditions_of("reacher", Effort(50, 50, 5, 0))
    counts = {condition.point: condition.rollouts for condition in conditions if condition.arm != NO_MESSAGE}
    assert counts[headline_point("reacher", 60)] == 50
    assert counts[next(cell.point for cell in paper_entries("reacher") if cell.point.arrangement == "split")] == 5


@pytest.mark.parametrize(("right", "verdict"), [(400, "higher"), (316, "agrees"), (200, "lower")])
def test_a_cell_is_held_against_the_paper_s_by_their_intervals(right, verdict):
    cell = next(cell for cell in paper_entries("discovery") if cell.percent == 79.0)
    goals = Proportion(right, 400)
    assert (
        against_the_paper(
            Row(
                arm="message",
                point=cell.point,
                detector="coherency",
                rollouts=50,
                goals=goals,
                symbols=goals,
                margin=0.1,
                paper=cell,
            )
        )
        == verdict
    )


def row_of(ticks, detector, right):
    goals = Proportion(right, 400)
    return Row(
        arm="message",
        point=headline_point("reacher", ticks),
        detector=detector,
        rollouts=50,
        goals=goals,
        symbols=goals,
        margin=0.1,
    )


def test_the_shortest_message_is_the_last_of_those_read_as_well():
    rows = [row_of(240, "coherency", 399), row_of(60, "coherency", 120)]
    rows += [row_of(ticks, "matched", right) for ticks, right in ((240, 400), (96, 398), (60, 396), (40, 270))]
    assert shortest_ticks(rows, "matched") == 60
    assert shortest_ticks(rows, "coherency") == 240


def test_a_longer_message_read_badly_ends_the_search():
    rows = [row_of(240, "coherency", 399)]
    rows += [row_of(ticks, "matched", right) for ticks, right in ((240, 400), (96, 300), (60, 400))]
    assert shortest_ticks(rows, "matched") == 240


def test_a_detector_that_never_reads_as_well_has_no_shortest():
    assert shortest_ticks([row_of(240, "coherency", 399), row_of(240, "matched", 300)], "matched") is None
