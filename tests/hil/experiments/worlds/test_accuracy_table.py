import json
from dataclasses import replace

import pytest

from hil.cli import main
from hil.experiments.detectors.accuracy_rollout import WHOLE, read_rollout, rollout_parameters
from hil.experiments.worlds.accuracy_table import grid
from hil.plants.mecanum import calibrated_parameters
from hil.worlds.robomaster import fleet_scheme
from mtm_audit.planning.table import read_table
from mtm_onboard.protocol import MtmError
from mtm_onboard.protocol.schemefile import save_scheme

PLANT = calibrated_parameters()
ONE_CELL = ("--alphabet", "4", "--window", "100", "--windows", "4", "-n", "2")


@pytest.fixture
def sweep(tmp_path, capsys):
    """Run `mtm-hil sweep robomaster`; gives the exit code, standard output and standard error."""

    def run(*options, name="table.csv", cells="cells.jsonl"):
        arguments = ["sweep", "robomaster", "--out", tmp_path / name, "--cells", tmp_path / cells, "--workers", "1"]
        with pytest.raises(SystemExit) as left:
            main([*map(str, (*arguments, *options))])
        out, err = capsys.readouterr()
        assert "Traceback" not in err
        return left.value.code or 0, out, err

    return run


def unequal_scheme(**changes):
    channels = fleet_scheme().channels
    counts = (2, 1, 1, 1)
    own = tuple(replace(channel, symbols=count) for channel, count in zip(channels, counts, strict=True))
    return replace(fleet_scheme(200), channels=own, **changes)


def test_a_sweep_measures_channels_alone_and_sets_pooled(sweep, tmp_path):
    code, out, _ = sweep(*ONE_CELL)
    table = read_table(tmp_path / "table.csv")
    assert (code, len(table.points), len(table.channels)) == (0, 15, 15)
    assert "15 points of 15 channels" in out
    assert {(point.alphabet_size, point.window_ticks, point.trials) for point in table.points} == {(4, 100, 8)}
    by_name = {point.channel: point for point in table.points}
    assert by_name["robot0+robot1+robot2+robot3"].successes == 8
    assert sum(by_name[f"robot{number}"].successes for number in range(4)) >= 28
    assert (
        (tmp_path / "table.csv")
        .read_text()
        .startswith("# mtm-hil sweep robomaster -n 2 --alphabet 4 --window 100 --windows 4 ")
    )


def test_an_interrupted_sweep_goes_on_and_says_the_same(sweep, tmp_path):
    sweep(*ONE_CELL)
    cells = tmp_path / "cells.jsonl"
    lines = cells.read_bytes().splitlines(keepends=True)
    cells.write_bytes(lines[0] + lines[1][:20])
    sweep(*ONE_CELL, name="again.csv")
    assert len(cells.read_bytes().splitlines()) == 2
    assert read_table(tmp_path / "again.csv") == read_table(tmp_path / "table.csv")


def test_held_out_seeds_are_other_rollouts(sweep, tmp_path):
    sweep(*ONE_CELL)
    sweep(*ONE_CELL, "--first-seed", "800000")
    lines = (tmp_path / "cells.jsonl").read_text().splitlines()
    assert [json.loads(json.loads(line)["cell"])[2] for line in lines] == [700_000, 700_001, 800_000, 800_001]


def test_a_scheme_file_has_its_own_windows_measured(sweep, tmp_path):
    save_scheme(unequal_scheme(), tmp_path / "plan.toml")
    code, out, _ = sweep("--scheme", tmp_path / "plan.toml", "-n", "2")
    points = read_table(tmp_path / "table.csv").points
    assert code == 0
    assert [(point.channel, point.window_ticks, point.trials) for point in points] == [
        ("robot0", 100, 4), ("robot1", 200, 2), ("robot2", 200, 2), ("robot3", 200, 2),
    ]  # fmt: skip
    assert out.startswith("whole messages right: 2 of 2, 100.0 % [15.8-100.0]")


@pytest.mark.parametrize("combine", ["split", "same"])
def test_a_whole_message_is_all_that_its_carriers_send(combine):
    scheme = replace(fleet_scheme(200), combine=combine)
    result = read_rollout(rollout_parameters(scheme, "matched", PLANT), 5)
    carriers = ["robot0+robot1+robot2+robot3"] if combine == "same" else [f"robot{n}" for n in range(4)]
    assert result[WHOLE] == all(result[name] == 1 for name in carriers)


def test_noise_that_is_drowned_out_is_decoded_at_chance():
    faint = unequal_scheme()
    faint = replace(faint, channels=tuple(replace(channel, sigma=1e-6) for channel in faint.channels))
    right = [
        sum(int(value) for name, value in read_rollout(rollout_parameters(faint, "matched", PLANT), seed).items()
            if name != WHOLE)
        for seed in range(8)
    ]  # fmt: skip
    # 40 symbols of four: 10 expected, and more than 19 would have a probability of one in a thousand.
    assert sum(right) <= 19


def test_the_paper_s_detector_can_measure_as_well():
    result = read_rollout(rollout_parameters(fleet_scheme(300), "coherency", PLANT), 3)
    assert sum(int(result[f"robot{number}"]) for number in range(4)) >= 3


def test_a_grid_has_one_scheme_for_each_alphabet_and_window():
    schemes = grid("robomaster", [4, 16], [100, 50], 3)
    assert [(scheme.alphabet_size, scheme.message_ticks) for scheme in schemes] == [
        (4, 300), (4, 150), (16, 300), (16, 150),
    ]  # fmt: skip
    assert [channel.symbols for scheme in schemes for channel in scheme.channels] == [3] * 16


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (("--window", "5"), "the shortest window that works is 20 ticks"),
        (("--alphabet", "1"), "alphabet_size is 1"),
        (("--detector", "oracle"), "no detector 'oracle' to measure with; choose one of: matched, coherency"),
        (("--scheme", "none.toml"), "cannot read the scheme file none.toml"),
        (("--scheme", "none.toml", "--alphabet", "4"), "leave out --alphabet and --window"),
    ],
)
def test_what_cannot_be_measured_is_refused_before_the_work(sweep, tmp_path, options, says):
    code, out, err = sweep(*options)
    assert (code, out) == (2 if "choose one of" in says else 1, "")
    assert err.startswith("mtm-hil: ")
    assert says in err
    assert not (tmp_path / "table.csv").exists()


def test_an_unknown_world_is_refused():
    with pytest.raises(MtmError, match="there is no world 'mars'; choose one of: robomaster"):
        grid("mars", [4], [100], 2)
