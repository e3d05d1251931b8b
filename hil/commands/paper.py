"""`mtm-hil paper`: the paper's tables, measured here."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from rich.console import Console

from hil.experiments.detectors.paper_robomaster import measure, rich_table, write_csv
from hil.experiments.runs.cells import CellStore
from hil.experiments.worlds import performance as world_performance
from hil.experiments.worlds import report as world_report
from hil.experiments.worlds.tables import Condition, Effort, Row, conditions_of, null_conditions_of
from hil.experiments.worlds.tables import measure as measure_world
from hil.plants.mecanum import calibrated_parameters
from hil.worlds.registry import NAMES, make_world
from mtm_onboard.protocol import MtmError
from mtm_onboard.protocol.output_file import check_outputs

# Points other than the headline's scheme take a tenth of the rollouts; one rollout of Football tries one of its 64
# strategies, so that its rollouts come in such numbers.
_PART = 10
_STRATEGIES = 64
_FOOTBALL_PART = 10
_FOOTBALL_COMPARED = 2
_QUICK_ROLLOUTS = 1


@dataclass(frozen=True, kw_only=True)
class WorldOptions:
    """What the command line asked of the simulated worlds; `out` a CSV file, or a folder for several."""

    rollouts: int
    quick: bool
    first_seed: int
    renderer: str
    workers: int | None
    out: Path | None
    cells: Path
    force: bool = False

    def effort(self, world: str) -> Effort:
        """How much to measure in a world."""
        count = _QUICK_ROLLOUTS if self.quick else self.rollouts
        rollouts = count, count, max(1, count // _PART)
        if world == "football" and not self.quick:
            times = max(1, count // _FOOTBALL_PART)
            rollouts = _STRATEGIES * times, _STRATEGIES * min(times, _FOOTBALL_COMPARED), _STRATEGIES
        return Effort(*rollouts, self.first_seed, self.renderer, self.quick)

    def command(self, what: str) -> str:
        """The command line."""
        parts = [f"mtm-hil paper {what}", "--quick" if self.quick else f"-n {self.rollouts}"]
        parts += [f"--seed {self.first_seed}", f"--renderer {self.renderer}"]
        return " ".join([*parts, f"--out {self.out}"])


def paper_robomaster(rollouts: int, out: Path | None, cells: Path, console: Console) -> None:
    """Measure, print and, where asked, write the RoboMaster table."""
    plant = calibrated_parameters()
    with CellStore(cells) as store:
        rows = measure(plant, rollouts, store, console)
    console.print(rich_table(rows))
    if out is not None:
        write_csv(out, rows, f"mtm-hil paper robomaster -n {rollouts} --out {out}", (f"{plant}",))
        print(f"wrote {out}")


def paper_table(name: str, options: WorldOptions, console: Console) -> None:
    """The table of that name: a world's, or `null`, `performance` or `all`."""
    CellStore.check(options.cells)
    if name == "all":
        _check_folder(options)
    else:
        check_outputs(f"mtm-hil paper {name}", options.out, force=options.force)
    whole = {"null": paper_null, "performance": paper_performance, "all": paper_all}
    if name in whole:
        whole[name](options, console)
    else:
        paper_world(name, options, console)


def paper_world(world: str, options: WorldOptions, console: Console) -> None:
    """Measure, print and, where asked, write the tables of one world."""
    make_world(world)
    with CellStore(options.cells) as store:
        rows, seconds = _measured(world, options, conditions_of(world, options.effort(world)), store, console)
    console.print(world_report.rich_table(world, rows))
    summary = world_report.shortest_messages(rows)
    print(summary)
    if options.out is not None:
        took = f"its cells took {seconds / 60:.0f} minutes of one core"
        world_report.write_csv(options.out, rows, options.command(world), (took, summary, *world_report.remarks(world)))
        print(f"wrote {options.out}")


def paper_all(options: WorldOptions, console: Console) -> None:
    """All tables of the simulated worlds, in a folder where asked."""
    _check_simulators()
    folder = options.out
    parts = {"null": paper_null, "performance": paper_performance}
    for name in (*NAMES, *parts):
        own = replace(options, out=None if folder is None else folder / f"{name}.csv")
        if name in parts:
            parts[name](own, console)
        else:
            paper_world(name, own, console)


def paper_null(options: WorldOptions, console: Console) -> None:
    """Measure and print the null conditions of all worlds, and write them where asked."""
    _check_simulators()
    tables: list[tuple[str, list[Row]]] = []
    with CellStore(options.cells) as store:
        for world in NAMES:
            rows, _ = _measured(world, options, null_conditions_of(world, options.effort(world)), store, console)
            tables.append((world, rows))
            console.print(world_report.rich_table(world, rows))
    if options.out is not None:
        world_report.write_null_csv(options.out, tables, options.command("null"))
        print(f"wrote {options.out}")


def paper_performance(options: WorldOptions, console: Console) -> None:
    """Measure and print what the noise costs the tasks of all worlds, and write it where asked."""
    _check_simulators()
    rollouts = _QUICK_ROLLOUTS if options.quick else options.rollouts
    with CellStore(options.cells) as store:
        rows = world_performance.measure(NAMES, rollouts, options.first_seed, store, console, options.workers)
    console.print(world_performance.rich_table(rows))
    if options.out is not None:
        world_performance.write_csv(options.out, rows, options.command("performance"))
        print(f"wrote {options.out}")


def _measured(
    world: str, options: WorldOptions, conditions: Sequence[Condition], store: CellStore, console: Console
) -> tuple[list[Row], float]:
    return measure_world(world, options.effort(world), conditions, store, console, options.workers)


def _check_folder(options: WorldOptions) -> None:
    folder = options.out
    if folder is None:
        return
    if not folder.is_dir():
        raise MtmError(f"{folder} is no folder; make it, or name another")
    for name in (*NAMES, "null", "performance"):
        check_outputs(f"mtm-hil paper {name}", folder / f"{name}.csv", force=options.force)


def _check_simulators() -> None:
    """Fail before anything is computed when a simulator is missing."""
    for world in NAMES:
        make_world(world)
