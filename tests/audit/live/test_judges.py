import os
import signal

import pytest

from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.live.judges import JudgeBeside
from mtm_audit.live.judging import Seen
from mtm_audit.live.looks import Look
from mtm_audit.live.poses import PoseTracks
from mtm_onboard.protocol import MtmError
from tests.audit.live.watched import KEY, poses

LOOK = Look(8, 4.0, 90)


def seen():
    gathered = PoseTracks()
    for pose in poses(None, 4.0):
        gathered.put(pose)
    return Seen(tuple(gathered.tracks()))


@pytest.fixture
def judge():
    beside = JudgeBeside(KEY, DecodeSettings())
    yield beside
    beside.close()


def result_of(judge):
    judge.wait()
    return judge.finished()


def end_the_process(judge):
    (process,) = judge._pool._processes.values()
    os.kill(process.pid, signal.SIGKILL)
    process.join()


def test_a_process_that_was_ended_is_replaced_and_its_look_lost(judge):
    assert result_of(judge) is None
    judge.begin(LOOK, seen())
    end_the_process(judge)
    assert judge.is_busy
    assert result_of(judge) is None
    assert not judge.is_busy
    judge.begin(LOOK, seen())
    assert result_of(judge).decoding.verdict == "absent"


def test_one_that_is_ended_each_time_is_one_sentence(judge):
    result_of(judge)
    for _ in range(2):
        judge.begin(LOOK, seen())
        end_the_process(judge)
        assert result_of(judge) is None
    judge.begin(LOOK, seen())
    end_the_process(judge)
    with pytest.raises(MtmError, match="ended from outside each time"):
        result_of(judge)
