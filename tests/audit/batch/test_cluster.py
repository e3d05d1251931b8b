"""Work on a real scheduler with three worker processes, one of which is killed midway."""

import sys
import threading

import pytest

from mtm_audit.batch.cluster import on_cluster
from mtm_audit.batch.lost import Lost
from mtm_onboard.protocol import MtmError
from tests.audit.batch.calls import calls
from tests.audit.batch.cluster_of_three import cluster_of
from tests.patience import until

__all__ = ["calls"]


def test_a_killed_worker_loses_and_doubles_nothing(calls, tmp_path):
    path = tmp_path / "begun"
    work = [(str(path), 0.2)] * 30

    def kill(worker):
        until(lambda: path.exists() and len(path.read_text().splitlines()) > 8)
        worker.kill()

    with cluster_of(tmp_path) as cluster:
        killer = threading.Thread(target=kill, args=cluster.workers[:1])
        killer.start()
        results = list(on_cluster(calls.logged, work, cluster.address))
        killer.join()
        assert cluster.workers[0].wait() != 0
    assert sorted(results) == [(place, "done") for place in range(30)]
    # Equal arguments are work of their own, and what was lost began again.
    assert len(path.read_text().splitlines()) >= 30


def test_a_scheduler_that_ends_gets_one_sentence(calls, tmp_path, capfd):
    path = tmp_path / "begun"
    with cluster_of(tmp_path, workers=1) as one:
        results = on_cluster(calls.logged, [(str(path), 0.1)] * 30, one.address)
        assert next(results)[1] == "done"
        one.scheduler.kill()
        with pytest.raises(MtmError, match=r"^the scheduler at tcp://.* is gone; start it again"):
            list(results)
    assert capfd.readouterr().err == ""


@pytest.mark.long
def test_what_kills_each_worker_is_lost_and_others_are_not(calls, tmp_path):
    with cluster_of(tmp_path, workers=6) as six:
        assert dict(on_cluster(calls.killed_by_two, range(5), six.address)) == {0: 0, 1: 1, 2: Lost(), 3: 3, 4: 4}


def test_a_function_that_raises_ends_the_work(calls, tmp_path):
    with cluster_of(tmp_path, workers=1) as one:
        with pytest.raises(MtmError, match="^this machine has no key$"):
            list(on_cluster(calls.refused, range(3), one.address))
        with pytest.raises(MtmError, match=r"^a worker of tcp://.* cannot do this \(ZeroDivisionError"):
            list(on_cluster(calls.broken, range(3), one.address))


def test_a_cluster_without_workers_gets_one_sentence(calls, tmp_path):
    with cluster_of(tmp_path, workers=0) as empty, pytest.raises(MtmError, match="has no workers; start some with"):
        list(on_cluster(calls.square, [1], empty.address))


@pytest.mark.parametrize("address", ["tcp://127.0.0.1:9", "nonsense", "tcp://", "127.0.0.1"])
def test_where_no_scheduler_answers_gets_one_sentence(calls, address, monkeypatch):
    monkeypatch.setattr("mtm_audit.batch.cluster._CONNECT_S", 0.5)
    with pytest.raises(MtmError, match="^no Dask scheduler answers at .*; start one with"):
        list(on_cluster(calls.square, [1], address))


def test_without_dask_one_sentence_names_the_extra(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(MtmError, match=r"needs Dask, .*pip install 'messages-through-motion\[cluster\]', or leave"):
        list(on_cluster(abs, [1], "tcp://127.0.0.1:9"))
