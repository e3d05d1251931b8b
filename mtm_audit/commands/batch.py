"""`mtm-audit batch`: many recordings under one or more keys, into one table."""

import math
import os
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from mtm_audit.batch.found import find_recordings
from mtm_audit.batch.plan import Plan
from mtm_audit.batch.results import check_results
from mtm_audit.batch.row import UNREADABLE
from mtm_audit.batch.run import Batched, Where, run_batch
from mtm_audit.batch.trackcache import TrackCache, usual_folder
from mtm_audit.decoding.speeds import check_speed
from mtm_audit.detectors import make_detector
from mtm_audit.tracking.registry import tracker
from mtm_onboard.protocol.key import load_key

_VERDICTS = ("decoded", "inconclusive", "absent", UNREADABLE)


@dataclass(frozen=True, kw_only=True)
class BatchOptions:
    """What the command line asked for; `jobs` None takes every core, `scheduler` a cluster in their place."""

    paths: tuple[Path, ...]
    plan: Plan
    out: Path
    jobs: int | None
    scheduler: str | None
    force: bool


def run_batch_command(options: BatchOptions) -> int:
    """Read, write the table and sum it up; returns 1 when a recording could not be read, else 0.

    Raises MtmError before any work where that cannot be done, and when it cannot go on.
    """
    plan = options.plan
    check_results(options.out, force=options.force)
    make_detector(plan.settings.detector, plan.settings.profile)
    tracker(plan.tracker)
    check_speed(1.0 if plan.speed is None else plan.speed)
    TrackCache(plan.cache or usual_folder()).check()
    _warn_of_keys(plan)
    found = find_recordings(options.paths, options.out)
    jobs = len(os.sched_getaffinity(0)) if options.jobs is None else options.jobs
    with _shown(len(found)) as progress:
        batched = run_batch(plan, found, options.out, Where(jobs, options.scheduler), progress, force=options.force)
    sys.stdout.write(_summary(plan, batched, options.out))
    return 1 if any(rows[0].verdict == UNREADABLE for rows in batched.rows) else 0


def _warn_of_keys(plan: Plan) -> None:
    for key in plan.keys:
        warning = load_key(key.path).warning
        if warning is not None:
            sys.stderr.write(f"mtm-audit: {warning}\n")


def _summary(plan: Plan, batched: Batched, out: Path) -> str:
    counts = Counter(_of_recording([row.verdict for row in rows]) for rows in batched.rows)
    total = len(batched.rows)
    parts = ", ".join(f"{counts[verdict]} {verdict}" for verdict in _VERDICTS if counts[verdict])
    lines = [f"{total} recording{'' if total == 1 else 's'}: {parts}; the table is {out}"]
    if batched.kept:
        lines.append(f"{batched.kept} of them were read before and have not changed, so their rows were kept.")
    if (tried := len(plan.keys)) > 1:
        lines.append(
            f"{tried} keys were tried on each, which costs {math.log2(tried):.1f} bits that are taken off: a recording "
            f"is called decoded by mistake at most {plan.settings.threshold:g} of the time, whichever key it is."
        )
    if counts[UNREADABLE]:
        lines.append(f"The column error says why {counts[UNREADABLE]} could not be read; the same command tries again.")
    return "\n".join(lines) + "\n"


def _of_recording(verdicts: list[str]) -> str:
    return min(verdicts, key=_VERDICTS.index)


@contextmanager
def _shown(total: int) -> Iterator[Callable[[int], None]]:
    """What is told how many recordings are done: a bar on standard error, only where a person watches."""
    console = Console(stderr=True)
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task("recordings", total=total)
        yield lambda done: progress.update(task, completed=done)
