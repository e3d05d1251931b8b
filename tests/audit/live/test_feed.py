import threading

import pytest

from mtm_audit.live.events import Notice, Pose, Quiet
from mtm_audit.live.feed import Feed
from mtm_onboard.protocol import MtmError

POSES = [Pose("r", float(number), 0.0, 0.0) for number in range(500)]


def heard(feed):
    return [event for event in feed if not isinstance(event, Quiet)]


def test_a_file_waits_and_loses_nothing():
    feed = Feed(iter(POSES), is_live=False)
    assert heard(feed) == POSES
    assert feed.lost == 0


def test_what_comes_too_fast_is_lost_counted_and_told_once():
    read = threading.Event()

    def source():
        yield from POSES
        read.set()

    feed, found = Feed(source(), is_live=True), []
    for event in feed:
        read.wait()
        if not isinstance(event, Quiet):
            found.append(event)
    told = [event for event in found if isinstance(event, Notice)]
    assert len(told) == 1
    assert "too slow" in told[0].sentence
    assert len(found) - len(told) + feed.lost == len(POSES)
    assert feed.lost > 300


def test_a_silent_source_is_quiet_and_no_standstill():
    asked = threading.Event()

    def source():
        asked.wait()
        yield POSES[0]

    events = iter(Feed(source(), is_live=True))
    assert next(events) == Quiet()
    asked.set()
    assert POSES[0] in list(events)


def test_what_ends_a_source_is_raised_where_it_is_watched():
    def source():
        yield POSES[0]
        raise MtmError("the camera is gone")

    with pytest.raises(MtmError, match="the camera is gone"):
        heard(Feed(source(), is_live=False))
