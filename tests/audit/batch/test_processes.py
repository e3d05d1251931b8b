import os

import pytest

from mtm_audit.batch.lost import Lost
from mtm_audit.batch.processes import in_processes
from mtm_onboard.protocol import MtmError
from tests.audit.batch.calls import calls
from tests.patience import until

__all__ = ["calls"]


def test_each_argument_is_computed_once_in_other_processes(calls):
    results = dict(in_processes(calls.square, range(7), 2))
    assert [results[number][0] for number in range(7)] == [number**2 for number in range(7)]
    processes = {process for _, process, _ in results.values()}
    assert len(processes) == 2
    assert os.getpid() not in processes
    assert {threads for *_, threads in results.values()} == {"1"}


def test_a_process_that_dies_takes_no_other_result_along(calls):
    assert dict(in_processes(calls.killed_by_two, range(5), 2)) == {0: 0, 1: 1, 2: Lost(), 3: 3, 4: 4}


def test_what_a_process_was_killed_at_is_tried_once_more(calls, tmp_path):
    assert list(in_processes(calls.killed_at_first, [str(tmp_path / "begun")], 1)) == [(0, "done")]


@pytest.mark.parametrize(
    ("name", "sentence"),
    [("refused", "^this machine has no key$"), ("broken", "^a worker process failed: ZeroDivisionError: odd$")],
)
def test_a_function_that_raises_ends_the_work(calls, name, sentence):
    with pytest.raises(MtmError, match=sentence):
        list(in_processes(getattr(calls, name), range(3), 1))


def test_leaving_ends_the_processes_at_once(calls, tmp_path):
    path = tmp_path / "pid"
    results = in_processes(calls.for_ever, [str(path)], 1)
    with pytest.raises(KeyboardInterrupt):
        _interrupted(results, path)
    with pytest.raises(ProcessLookupError):
        os.kill(int(path.read_text()), 0)


def _interrupted(results, path):
    """Interrupt this process while it waits for the other."""
    import signal
    import threading

    def interrupt():
        until(path.exists)
        until(path.read_text)
        os.kill(os.getpid(), signal.SIGINT)

    threading.Thread(target=interrupt).start()
    list(results)


def test_nothing_to_do_starts_no_process(calls):
    assert list(in_processes(calls.square, [], 4)) == []
