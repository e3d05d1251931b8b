"""`mtm-hil bench --rates`: how often symbols are right at 5, 6 and 8 bits/s, beside the genie and the capacity."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.table import Table

from hil.experiments.detectors.rates import DETECTORS, FIRST_SEED, JOBS, RateJob, RateRow, rate_rows
from hil.experiments.runs.cells import CellStore
from hil.experiments.runs.result_file import write_result_csv
from hil.plants.mecanum import calibrated_parameters
from mtm_onboard.protocol.errors import WrongValueError

_COLUMNS = (
    "bits_per_s", "alphabet_size", "window_ticks", "axes", "rollouts", "symbols",
    *(f"{name}{end}" for name in DETECTORS for end in ("", "_low", "_high")), "capacity_bits_per_s", "share",
)  # fmt: skip
ALL = "all"


@dataclass(frozen=True)
class RatesOptions:
    """Which rates, how many rollouts of each, and where they are written."""

    rates: str
    rollouts: int
    out: Path | None
    cells: Path


def bench_rates(options: RatesOptions, console: Console) -> None:
    """Measure, print and, where asked, write the table; raises MtmError for a rate that is not measured."""
    jobs = _jobs(options.rates)
    with CellStore(options.cells) as store:
        rows = rate_rows(jobs, calibrated_parameters(), options.rollouts, store, console)
    console.print(_table(rows))
    if options.out is not None:
        command = f"mtm-hil bench --rates {options.rates} --rollouts {options.rollouts} --out {options.out}"
        notes = (
            "four robots, four symbols each, sigma 0.1 m/s and 0.2 rad/s, 0.5 m/s, onset known, "
            f"seeds from {FIRST_SEED}",
            "share: of the capacity of Gaussian interference that the rate is",
        )
        write_result_csv(options.out, command, _COLUMNS, [_line(row, options.rollouts) for row in rows], notes)
        print(f"wrote {options.out}")


def _jobs(rates: str) -> list[RateJob]:
    if rates == ALL:
        return list(JOBS)
    known = {_name(job): job for job in JOBS}
    asked = [name.strip() for name in rates.split(",")]
    strange = next((name for name in asked if name not in known), None)
    if strange is not None:
        raise WrongValueError(f"there is no rate {strange!r}; choose all or some of: {', '.join(known)}")
    return [known[name] for name in asked]


def _name(job: RateJob) -> str:
    return f"{job.alphabet_size}x{job.window_ticks}{'+yaw' if job.yaw else ''}"


def _line(row: RateRow, rollouts: int) -> tuple[object, ...]:
    job = row.job
    shares = [row.symbols[name] for name in DETECTORS]
    values = [figure for share in shares for figure in share.figures]
    axes = " ".join(job.scheme.channels[0].axes)
    return (
        f"{job.rate_bps:.2f}", job.alphabet_size, job.window_ticks, axes, rollouts, shares[0].trials, *values,
        f"{row.capacity_bps:.2f}", f"{job.rate_bps / row.capacity_bps:.2f}",
    )  # fmt: skip


def _table(rows: Sequence[RateRow]) -> Table:
    table = Table(
        title="RoboMaster, four robots, onset known; percent of symbols with exact 95 % intervals", box=None,
        padding=(0, 1, 0, 0), pad_edge=False,
    )  # fmt: skip
    for name in ("bits/s", "scheme", "symbols", *DETECTORS, "capacity", "share"):
        table.add_column(name, justify="right", no_wrap=True)
    for row in rows:
        shares = [row.symbols[name] for name in DETECTORS]
        table.add_row(
            f"{row.job.rate_bps:.2f}", _name(row.job), str(shares[0].trials), *map(str, shares),
            f"{row.capacity_bps:.1f}", f"{100 * row.job.rate_bps / row.capacity_bps:.0f} %",
        )  # fmt: skip
    return table
