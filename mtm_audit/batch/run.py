"""A whole batch: what is still to do, doing it here or on a cluster, and the table of all."""

from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from mtm_audit.batch.cluster import on_cluster
from mtm_audit.batch.found import Found
from mtm_audit.batch.lost import Lost
from mtm_audit.batch.plan import Plan
from mtm_audit.batch.processes import in_processes
from mtm_audit.batch.reading import Work, read_rows
from mtm_audit.batch.results import ResultsFile, Rows
from mtm_audit.batch.row import UNREADABLE, printable
from mtm_audit.batch.told import unreadable_row
from mtm_onboard.protocol.errors import MtmError

_LOST = (
    "each process that read it was ended from outside or crashed, perhaps for want of memory; decode it alone to see "
    "why, and run the batch again"
)

# Told the number of recordings that are done, kept ones among them, after each.
Progress = Callable[[int], None]


@dataclass(frozen=True)
class Where:
    """The cores of this machine to use, or else the address of a Dask scheduler."""

    jobs: int = 1
    scheduler: str | None = None


@dataclass(frozen=True)
class Batched:
    """The rows of each recording in the order in which they were found, and how many were kept from an earlier run."""

    rows: tuple[Rows, ...]
    kept: int


def run_batch(
    plan: Plan, found: Sequence[Found], out: Path, where: Where, progress: Progress, *, force: bool = False
) -> Batched:
    """Read what has no rows yet in `out`, whose rows in the end are those of all of `found`, in their order.

    Rows are on disk as soon as they are made, so that a run that was stopped goes on where it was. Those of files that
    hold something else now, and of files that could not be read, are made anew. Raises MtmError as `ResultsFile` does,
    and when a worker cannot work at all.
    """
    names = [printable(item.name) for item in found]
    twice = next((name for name, count in Counter(names).items() if count > 1), None)
    if twice is not None:
        raise MtmError(f"two recordings would both be called {twice} in the table; rename one")
    with ResultsFile(out, plan.run, names, force=force) as results:
        todo = [Work(plan, item, _known(results.kept, name)) for item, name in zip(found, names, strict=True)]
        kept = 0
        for done, (place, rows) in enumerate(_worked(todo, where), 1):
            if rows is None:
                kept += 1
            else:
                results.add(names[place], rows)
            progress(done)
        return Batched(results.finish(names), kept)


def _known(kept: Mapping[str, Rows], name: str) -> str:
    rows = kept.get(name)
    return rows[0].sha256 if rows and rows[0].verdict != UNREADABLE else ""


def _worked(todo: Sequence[Work], where: Where) -> Iterator[tuple[int, Rows | None]]:
    """The rows of each by its place, None where those from before still hold."""
    if where.scheduler is None:
        results = in_processes(read_rows, todo, where.jobs)
    else:
        results = on_cluster(read_rows, todo, where.scheduler)
    for place, rows in results:
        work = todo[place]
        yield place, (unreadable_row(work.plan, work.found.name, _LOST),) if isinstance(rows, Lost) else rows
