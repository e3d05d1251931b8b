"""Computing many cells on all cores, or on a cluster."""

import multiprocessing
import os
import signal
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from contextvars import ContextVar

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from hil.experiments.runs.cells import Cell, CellStore, Scalar, Values
from hil.experiments.runs.fingerprint import code_fingerprint
from mtm_audit.batch.cluster import on_cluster
from mtm_audit.batch.lost import Lost
from mtm_audit.batch.processes import single_threaded_children
from mtm_onboard.protocol import MtmError

# A function of a module, so that it can be named in another process: parameters and seed to the cell's result.
Compute = Callable[[Values, int], Mapping[str, Scalar]]


# The address of the cluster that computes cells; None for this machine.
_scheduler: ContextVar[str | None] = ContextVar("scheduler", default=None)


@contextmanager
def swept_on(scheduler: str | None) -> Iterator[None]:
    """Sweeps in the block run on the Dask cluster with that scheduler; None leaves them on this machine."""
    token = _scheduler.set(scheduler)
    try:
        yield
    finally:
        _scheduler.reset(token)


def run_sweep(
    compute: Compute, cells: Sequence[Cell], store: CellStore, console: Console, workers: int | None = None
) -> list[Values]:
    """The result of each cell, in order; finished ones come from the store and new ones go there at once.

    `workers` processes with one numerical thread each (None: as many as there are cores; 1: this process alone), or
    inside `swept_on` a cluster in their place. An interrupt loses the cells being computed and no other. The first
    exception of a cell ends the sweep; raises MtmError when a process is ended from outside.
    """
    missing = [cell for cell in {cell.name: cell for cell in cells}.values() if store.find(cell) is None]
    count = len(os.sched_getaffinity(0)) if workers is None else workers
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task("rollouts", total=len(missing))
        scheduler = _scheduler.get()
        if scheduler is not None:
            computed = _on_cluster(compute, missing, scheduler)
        else:
            computed = _in_turn(compute, missing) if count == 1 else _in_processes(compute, missing, count)
        for cell, result in computed:
            store.add(cell, result)
            progress.advance(task)
    results = [store.find(cell) for cell in cells]
    return [result for result in results if result is not None]


def _in_turn(compute: Compute, cells: Sequence[Cell]) -> Iterator[tuple[Cell, Values]]:
    for cell in cells:
        yield cell, compute(cell.parameters, cell.seed)


def _in_processes(compute: Compute, cells: Sequence[Cell], workers: int) -> Iterator[tuple[Cell, Values]]:
    if not cells:
        return
    context = multiprocessing.get_context("spawn")
    with single_threaded_children():
        pool = ProcessPoolExecutor(min(workers, len(cells)), context, _leave_interrupts_to_the_parent)
        try:
            futures = {pool.submit(compute, dict(cell.parameters), cell.seed): cell for cell in cells}
            for future in as_completed(futures):
                yield futures[future], future.result()
        except BrokenProcessPool as error:
            raise MtmError("a worker process was ended from outside; run it again, finished cells are kept") from error
        finally:
            pool.shutdown(cancel_futures=True)


def _on_cluster(compute: Compute, cells: Sequence[Cell], scheduler: str) -> Iterator[tuple[Cell, Values]]:
    calls = [(code_fingerprint(), compute, dict(cell.parameters), cell.seed) for cell in cells]
    for place, result in on_cluster(_called, calls, scheduler) if calls else ():
        if isinstance(result, Lost):
            raise MtmError(f"{cells[place].name} ended every worker that computed it; finished cells are kept")
        yield cells[place], result


def _called(call: tuple[str, Compute, Values, int]) -> Values:
    """One cell on a worker; raises MtmError when it would be computed by other code."""
    code, compute, parameters, seed = call
    if code != code_fingerprint():
        raise MtmError("a worker runs another version of the program; install the same everywhere")
    return compute(parameters, seed)


def _leave_interrupts_to_the_parent() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)
