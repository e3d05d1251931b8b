"""`mtm-hil attacks`: the paper's two tables of attacks, and curves of those that it leaves open."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console

from hil.experiments.attacks.attack import Attack
from hil.experiments.attacks.measured import Row, measured
from hil.experiments.attacks.registry import ATTACKS
from hil.experiments.attacks.report import draw_plot, line_of, write_csv
from hil.experiments.runs.cells import CellStore
from hil.worlds.registry import make_world
from mtm_onboard.protocol import MtmError
from mtm_onboard.protocol.output_file import check_outputs


@dataclass(frozen=True, kw_only=True)
class AttackOptions:
    """What the command line asked for; `out` is a folder, in which each attack has a file."""

    names: tuple[str, ...]
    rollouts: int
    first_seed: int
    workers: int | None
    out: Path | None
    plot: Path | None
    force: bool
    cells: Path

    def command(self, attack: Attack) -> str:
        """The command line that writes one attack's file."""
        return f"mtm-hil attacks --only {attack.name} -n {self.rollouts} --seed {self.first_seed} --out {self.out}"


def attacks(options: AttackOptions, console: Console) -> None:
    """Measure, print and, where asked, write and draw."""
    chosen = _chosen(options.names)
    if options.out is not None:
        if not options.out.is_dir():
            raise MtmError(f"{options.out} is no folder; make it, or name another")
        check_outputs("mtm-hil attacks", *(_table(options.out, attack) for attack in chosen), force=options.force)
    groups: list[Sequence[Row]] = []
    with CellStore(options.cells) as store:
        make_world("discovery")
        for attack in chosen:
            rows = measured(attack, options.rollouts, options.first_seed, store, console, options.workers)
            groups.append(rows)
            print("\n".join(line_of(row) for row in rows))
            if options.out is not None:
                path = _table(options.out, attack)
                write_csv(path, attack, rows, options.command(attack))
                print(f"wrote {path}")
    if options.plot is not None:
        draw_plot(options.plot, groups)
        print(f"wrote {options.plot}")


def _table(folder: Path, attack: Attack) -> Path:
    return folder / f"attacks_{attack.name}.csv"


def _chosen(names: Sequence[str]) -> list[Attack]:
    unknown = [name for name in names if name not in ATTACKS]
    if unknown:
        raise MtmError(f"there is no attack {unknown[0]!r}; choose from: {', '.join(ATTACKS)}")
    return [attack for name, attack in ATTACKS.items() if not names or name in names]
