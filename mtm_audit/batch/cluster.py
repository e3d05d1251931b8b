"""A function of many arguments on many machines, by a Dask cluster whose scheduler is named by its address."""

import logging
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import TYPE_CHECKING, Any, TypeVar
from uuid import uuid4

from mtm_audit.batch.lost import Lost
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.installing import install_command

if TYPE_CHECKING:
    from distributed import Client

T = TypeVar("T")
R = TypeVar("R")

_CONNECT_S = 10.0


def on_cluster(function: Callable[[T], R], arguments: Sequence[T], scheduler: str) -> Iterator[tuple[int, R | Lost]]:
    """Yield (place, result) as they come, each place once, whatever becomes of workers.

    What a worker held that is lost is computed again, on another one, so that `function` has to give the same again; an
    argument that ends worker after worker is `Lost`. Raises MtmError when Dask is not installed, nobody answers at the
    address, no worker is there, or `function` raises. Leaving the iterator takes back what was not begun.
    """
    with _connected(scheduler) as client:
        from distributed import as_completed

        # Each a name of its own: Dask would compute equal arguments once, and take what another run left behind.
        names = [f"mtm-{uuid4().hex}" for _ in arguments]
        futures = client.map(function, list(arguments), key=names, pure=False)
        places = {future.key: place for place, future in enumerate(futures)}
        pending = as_completed(futures, loop=client.loop)
        del futures
        try:
            for future in pending:
                yield places[future.key], _result(future, scheduler)
                # Else it stays in the workers' memory, and is computed again when one of them is lost.
                future.release()
        finally:
            with suppress(Exception):
                client.cancel(list(pending.futures), force=True)


@contextmanager
def _connected(scheduler: str) -> Iterator["Client"]:
    try:
        from distributed import Client
    except ModuleNotFoundError as error:
        raise MtmError(
            f"--scheduler needs Dask, which is not installed; install it with: {install_command('cluster')}, or leave "
            "--scheduler out to use this machine's cores"
        ) from error
    try:
        client = Client(scheduler, timeout=_CONNECT_S, set_as_default=False)
    except (OSError, ValueError) as error:
        raise MtmError(
            f"no Dask scheduler answers at {scheduler}; start one with `dask scheduler`, and name the address that it "
            "prints, such as tcp://192.168.0.2:8786"
        ) from error
    with _silent(), client:
        if not client.scheduler_info()["workers"]:
            raise MtmError(f"the scheduler at {scheduler} has no workers; start some with `dask worker {scheduler}`")
        yield client


@contextmanager
def _silent() -> Iterator[None]:
    """Dask logs what is raised as well, with tracebacks on standard error."""
    names = [name for name in logging.root.manager.loggerDict if name.partition(".")[0] == "distributed"]
    former = {name: logging.getLogger(name).level for name in names}
    try:
        for name in names:
            logging.getLogger(name).setLevel(logging.CRITICAL + 1)
        yield
    finally:
        for name, level in former.items():
            logging.getLogger(name).setLevel(level)


def _result(future: Any, scheduler: str) -> Any:
    from concurrent.futures import CancelledError

    from distributed import KilledWorker

    try:
        return future.result()
    except KilledWorker:
        return Lost()
    except MtmError:
        raise
    except (CancelledError, OSError) as error:
        raise MtmError(
            f"the scheduler at {scheduler} is gone; start it again, and run the same command again"
        ) from error
    except Exception as error:
        raise MtmError(
            f"a worker of {scheduler} cannot do this ({type(error).__name__}: {error}); install the same version of "
            "the program on each"
        ) from error
