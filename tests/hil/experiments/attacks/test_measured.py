import numpy as np
import pytest

from hil.experiments.attacks import relay, splice
from hil.experiments.attacks.attack import Attack, PaperFigure
from hil.experiments.attacks.measured import cells_of, rows_of
from hil.experiments.attacks.registry import ATTACKS
from hil.experiments.attacks.report import draw_plot, line_of, write_csv
from hil.experiments.runs.cells import Cell

TABLE = Attack(
    name="made_up", level="strength", counted="messages right", levels={"arm": (0.0, 1.0)}, measure=lambda *_: {},
    chance_percent=12.5, share=0.5, batch=4, paper={("arm", 1.0): PaperFigure("tab:fake", 60.0, 0.1, 20.0, 5.0)},
)  # fmt: skip


def result(right, distance):
    return {"coherency trials": 100, "coherency right": right, "coherency margin": 0.5, "distortion": 0.25,
            "distance": distance}  # fmt: skip


@pytest.fixture
def rows():
    cells = [Cell("attacks", {"arm": "arm", "level": level}, 0) for level in (0.0, 1.0)]
    return rows_of(TABLE, cells, [result(100, 0.5), result(62, 0.6)])


def test_every_level_has_the_same_rollouts():
    cells = cells_of(TABLE, 20, 7)
    assert [(cell.parameters["level"], cell.parameters["rollouts"], cell.seed) for cell in cells] == [
        (level, size, seed) for level in (0.0, 1.0) for size, seed in ((4, 7), (4, 11), (2, 15))
    ]


def test_rows_stand_beside_the_paper_and_the_first_level(rows):
    first, second = rows
    assert (first.distance_percent, second.distance_percent) == (0.0, pytest.approx(20.0))
    assert second.distortion_percent == 25.0
    assert (first.against_the_paper, second.against_the_paper) == ("", "agrees")
    assert "62.0 [52-72], the paper 60 agrees" in line_of(second)


@pytest.mark.parametrize(("right", "verdict"), [(95, "higher"), (20, "lower")])
def test_intervals_apart_from_the_papers_are_told(right, verdict):
    cell = Cell("attacks", {"arm": "arm", "level": 1.0}, 0)
    table = Attack(**{**vars(TABLE), "levels": {"arm": (1.0,)}})
    assert rows_of(table, [cell], [result(right, 0.5)])[0].against_the_paper == verdict


def test_a_table_says_its_command_and_what_is_counted(rows, tmp_path):
    write_csv(tmp_path / "a.csv", TABLE, rows, "mtm-hil attacks --only made_up")
    first, code, note, header, *lines = (tmp_path / "a.csv").read_text().splitlines()
    assert first == "# mtm-hil attacks --only made_up"
    assert code.startswith("# code ")
    assert "messages right" in note
    assert dict(zip(header.split(","), lines[1].split(","), strict=True)) | {"paper_table": "tab:fake"} == dict(
        zip(header.split(","), lines[1].split(","), strict=True)
    )


def test_a_picture_is_drawn(rows, tmp_path):
    draw_plot(tmp_path / "a.png", [rows])
    assert (tmp_path / "a.png").read_bytes().startswith(b"\x89PNG")


def test_all_attacks_have_levels_names_and_a_chance():
    assert {"additive_noise", "band_stop", "noise_replacement", "whitening", "prediction", "jamming", "splice", "relay",
            "desynchronisation", "codebook_learning", "steganalysis", "distillation"} == set(ATTACKS)  # fmt: skip
    for name, attack in ATTACKS.items():
        assert attack.name == name
        assert all(len(levels) > 1 and list(levels) == sorted(levels) for levels in attack.levels.values())


def test_the_paper_s_tables_are_whole():
    shown = {name: list((ATTACKS[name].paper or {}).values()) for name in ("additive_noise", "band_stop")}
    assert [figure.percent for figure in shown["additive_noise"]] == [100.0, 100.0, 98.5, 69.3, 21.5, 17.0, 14.8]
    assert [figure.distance_percent for figure in shown["band_stop"][:6]] == [0.0, 4.3, 8.1, 12.2, 16.7, 21.5]


def test_a_relay_in_time_is_authenticated_and_later_is_not():
    assert relay.ATTACK.measure(relay.ARM, 1.0, 1, 0) == {"matched trials": 1, "matched right": 1}
    assert relay.ATTACK.measure(relay.ARM, 30.0, 1, 0)["matched right"] == 0


def test_a_splice_of_old_windows_is_not_authenticated():
    assert splice.ATTACK.measure(splice.ARM, 10.0, 1, 0)["matched right"] == 0
    assert np.isfinite(splice.ATTACK.chance_percent)
