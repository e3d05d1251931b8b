"""Computing many cells on all cores."""

import multiprocessing
import os
import signal
from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from hil.experiments.runs.cells import Cell, CellStore, Scalar, Values
from hil.fleet.programs import SINGLE_THREADED
from mtm_onboard.protocol import MtmError

# A function of a module, so that it can be named in another process: parameters and seed to the cell's result.
Compute = Callable[[Values, int], Mapping[str, Scalar]]


def run_sweep(
    compute: Compute, cells: Sequence[Cell], store: CellStore, console: Console, workers: int | None = None
) -> list[Values]:
    """The result of each cell, in order; finished ones come from the store and new ones go there at once.

    `workers` processes with one numerical thread each (None: as many as there are cores; 1: this process alone). An
    interrupt loses the cells being computed and no other. The first exception of a cell ends the sweep; raises MtmError
    when a process is ended from outside.
    """
    missing = [cell for cell in {cell.name: cell for cell in cells}.values() if store.find(cell) is None]
    count = len(os.sched_getaffinity(0)) if workers is None else workers
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as progress:
        task = progress.add_task("rollouts", total=len(missing))
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
    with _single_threaded_children():
        pool = ProcessPoolExecutor(min(workers, len(cells)), context, _leave_interrupts_to_the_parent)
        try:
            futures = {pool.submit(compute, dict(cell.parameters), cell.seed): cell for cell in cells}
            for future in as_completed(futures):
                yield futures[future], future.result()
        except BrokenProcessPool as error:
            raise MtmError("a worker process was ended from outside; run it again, finished cells are kept") from error
        finally:
            pool.shutdown(cancel_futures=True)


def _leave_interrupts_to_the_parent() -> None:
    signal.signal(signal.SIGINT, signal.SIG_IGN)


@contextmanager
def _single_threaded_children() -> Iterator[None]:
    former = {name: os.environ.get(name) for name in SINGLE_THREADED}
    os.environ.update(SINGLE_THREADED)
    try:
        yield
    finally:
        for name, value in former.items():
            if value is None:
                del os.environ[name]
            else:
                os.environ[name] = value
