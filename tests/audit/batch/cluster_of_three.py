"""A real Dask scheduler with three worker processes on loopback, for tests."""

import os
import re
import subprocess
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from pathlib import Path

from tests.patience import until

_DASK = (sys.executable, "-m", "dask")


@dataclass(frozen=True)
class Cluster:
    address: str
    workers: tuple[subprocess.Popen[bytes], ...]
    scheduler: subprocess.Popen[bytes]


@contextmanager
def cluster_of(folder: Path, workers: int = 3) -> Iterator[Cluster]:
    """Start the programs that a user starts; they end with the block."""
    environment = {**os.environ, "DASK_TEMPORARY_DIRECTORY": str(folder), "OMP_NUM_THREADS": "1"}
    with ExitStack() as stack:

        def start(log: str, *arguments: str) -> subprocess.Popen[bytes]:
            file = stack.enter_context((folder / log).open("wb"))
            process = subprocess.Popen([*_DASK, *arguments], stdout=file, stderr=file, env=environment, cwd=folder)
            stack.callback(process.wait)
            stack.callback(process.kill)
            return process

        scheduler = start("scheduler", "scheduler", "--host", "127.0.0.1", "--port", "0", "--no-dashboard", "--no-show")
        address = until(lambda: re.search(r"Scheduler at:\s+(tcp://\S+)", (folder / "scheduler").read_text()))[1]
        started = tuple(
            start(f"worker{number}", "worker", address, "--nthreads", "1", "--no-nanny", "--no-dashboard")
            for number in range(workers)
        )
        until(lambda: (folder / "scheduler").read_text().count("Register worker ") == workers)
        yield Cluster(address, started, scheduler)
