import importlib
import io
import os
import sys
import threading

import pytest
from rich.console import Console

from hil.experiments.runs.cells import Cell, CellStore
from hil.experiments.runs.sweep import run_sweep, swept_on
from mtm_onboard.protocol import MtmError
from tests.audit.batch.cluster_of_three import cluster_of
from tests.patience import until

QUIET = Console(file=io.StringIO())


# Another process imports what it computes from a module.
MODULE = """
import os
import time

def square(parameters, seed):
    return {"square": parameters["x"] ** 2 + seed, "process": os.getpid(), "threads": os.environ["OMP_NUM_THREADS"]}

def logged(parameters, seed):
    with open(parameters["log"], "a") as log:
        log.write(f"{seed}\\n")
    time.sleep(0.2)
    return {"twice": 2 * seed}

def ended_from_outside(parameters, seed):
    os._exit(1)
"""


@pytest.fixture
def module(tmp_path, monkeypatch):
    (tmp_path / "cells_of_a_test.py").write_text(MODULE)
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.delitem(sys.modules, "cells_of_a_test", raising=False)
    return importlib.import_module("cells_of_a_test")


def cells(count):
    return [Cell("squares", {"x": number}, number % 3) for number in range(count)]


def test_results_of_other_processes_come_in_the_cells_order(module, tmp_path):
    with CellStore(tmp_path / "cells.jsonl") as store:
        results = run_sweep(module.square, cells(6), store, QUIET, workers=2)
    assert [result["square"] for result in results] == [number**2 + number % 3 for number in range(6)]
    assert os.getpid() not in {result["process"] for result in results}
    assert {result["threads"] for result in results} == {"1"}


def test_a_sweep_that_was_interrupted_goes_on_where_it_was(tmp_path):
    calls = []

    def interrupted(parameters, seed):
        calls.append(parameters["x"])
        if len(calls) == 4:
            raise KeyboardInterrupt
        return {"x": parameters["x"]}

    with CellStore(tmp_path / "cells.jsonl") as store, pytest.raises(KeyboardInterrupt):
        run_sweep(interrupted, cells(6), store, QUIET, workers=1)
    with CellStore(tmp_path / "cells.jsonl") as store:
        assert [result["x"] for result in run_sweep(interrupted, cells(6), store, QUIET, workers=1)] == list(range(6))
    assert calls == [0, 1, 2, 3, 3, 4, 5]


def test_a_cell_that_is_asked_for_twice_is_computed_once(tmp_path):
    calls = []

    def count(parameters, seed):
        calls.append(seed)
        return {"n": len(calls)}

    with CellStore(tmp_path / "cells.jsonl") as store:
        assert run_sweep(count, [*cells(1), *cells(1)], store, QUIET, workers=1) == [{"n": 1}, {"n": 1}]
    assert calls == [0]


def test_a_process_that_is_ended_from_outside_gets_one_sentence(module, tmp_path):
    with CellStore(tmp_path / "cells.jsonl") as store, pytest.raises(MtmError, match="finished cells are kept"):
        run_sweep(module.ended_from_outside, cells(2), store, QUIET, workers=2)


@pytest.mark.long
def test_a_cluster_that_loses_a_worker_computes_the_same(module, tmp_path, monkeypatch):
    monkeypatch.setenv("PYTHONPATH", f"{tmp_path}:{os.environ.get('PYTHONPATH', '')}")
    log = tmp_path / "log"
    asked = [Cell("logged", {"log": str(log)}, seed) for seed in range(24)]

    def kill(worker):
        until(lambda: log.exists() and len(log.read_text().splitlines()) > 6)
        worker.kill()

    with cluster_of(tmp_path) as cluster, CellStore(tmp_path / "cells.jsonl") as store, swept_on(cluster.address):
        killer = threading.Thread(target=kill, args=cluster.workers[:1])
        killer.start()
        results = run_sweep(module.logged, asked, store, QUIET)
        killer.join()
        begun = len(log.read_text().splitlines())
        assert run_sweep(module.logged, asked, store, QUIET) == results
    assert results == [{"twice": 2 * seed} for seed in range(24)]
    assert len((tmp_path / "cells.jsonl").read_text().splitlines()) == 24
    assert len(log.read_text().splitlines()) == begun >= 24


def test_a_cluster_is_not_used_outside_its_block(tmp_path):
    with swept_on("tcp://127.0.0.1:9"):
        pass
    with CellStore(tmp_path / "cells.jsonl") as store:
        assert run_sweep(lambda parameters, seed: {"x": 1}, cells(1), store, QUIET, workers=1) == [{"x": 1}]
