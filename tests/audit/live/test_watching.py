import math
from dataclasses import replace

import numpy as np
import pytest

from mtm_audit.decoding.decode import decode_tracks
from mtm_audit.decoding.pieces import part_of_track
from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.live import judging, watching
from mtm_audit.live.events import Notice, Pose, Quiet
from mtm_audit.live.judging import Seen, judge
from mtm_audit.live.looks import Look
from mtm_audit.live.poses import PoseTracks
from tests.audit.decoding.test_framed_decode import NOON_S, ROLLING, rolling_tracks
from tests.audit.live.watched import KEY, JudgeLater, poses, watch_of
from tests.audit.moving_robot import OTHER_SECRET, key_of


def tracks_of(events, until_s):
    gathered = PoseTracks()
    for event in events:
        gathered.put(event)
    return [part_of_track(track, -math.inf, until_s) for track in gathered.tracks()]


@pytest.fixture(scope="module")
def decoded():
    return watch_of(poses())


def test_a_watch_stops_at_the_verdict(decoded):
    watch, told = decoded
    assert watch.is_decided
    assert watch.best.decoding.message == 2
    assert told.events < len(poses())


def test_offline_at_the_paid_threshold_decides_at_the_same_look(decoded):
    """Of the same prefix; the look before it, a second earlier at most, was not enough."""
    watch, told = decoded
    before, deciding = told.looks[-2:]
    assert deciding is watch.best
    for judged, verdict in ((before, False), (deciding, True)):
        paid = DecodeSettings(threshold=1e-4 / judged.look.choices)
        offline = decode_tracks(tracks_of(poses(), judged.look.until_s), KEY, paid)
        assert (offline.verdict == "decoded") is verdict
    assert deciding.look.until_s - before.look.until_s <= 1.0


def test_the_evidence_of_a_look_is_that_of_decode_less_its_price(decoded):
    watch, _ = decoded
    look, found = watch.best.look, watch.best.decoding
    offline = decode_tracks(tracks_of(poses(), look.until_s), KEY, DecodeSettings())
    assert found.evidence.nats == pytest.approx(offline.evidence.nats - math.log(look.choices))
    assert found.symbol_nats[0] == pytest.approx(offline.symbol_nats[0] - math.log(look.choices))


def test_when_times_begin_does_not_matter(decoded):
    watch, _ = watch_of(poses(begin_s=1000.0))
    assert watch.best.look == decoded[0].best.look


def test_silence_is_absent_after_the_look_at_the_end():
    watch, told = watch_of(poses(None))
    assert not watch.is_decided
    assert told.looks[-1].look.number == 0
    assert watch.best.decoding.verdict == "absent"


def test_another_key_reads_nothing():
    watch, _ = watch_of(poses(), key=key_of(KEY.scheme, OTHER_SECRET))
    assert watch.best.decoding.verdict == "absent"


def test_a_time_that_was_fixed_ends_the_watch():
    watch, told = watch_of(poses(None), most_s=4.0)
    assert told.events == 100
    assert watch.best.look.choices == 2


def test_while_a_look_is_judged_the_watch_goes_on():
    judge_later = JudgeLater(KEY, DecodeSettings(), asked=60)
    watch, told = watch_of(poses(), judge_later)
    numbers = [judged.look.number for judged in told.looks]
    assert watch.is_decided
    assert numbers != list(range(1, len(numbers) + 1))
    # What was paid goes by the schedule, whatever was left out.
    assert all(judged.look.choices == (judged.look.number + 1) * (judged.look.number + 2) for judged in told.looks
               if judged.look.number)  # fmt: skip


def test_a_file_waits_for_its_looks(decoded):
    watch, told = watch_of(poses(), JudgeLater(KEY, DecodeSettings(), asked=60), waits=True)
    assert watch.best.look == decoded[0].best.look
    assert [judged.look.number for judged in told.looks] == list(range(1, len(told.looks) + 1))


def test_looks_are_taken_while_the_source_is_quiet():
    events = [event for event in poses() if event.time_s < 2.0]
    _, told = watch_of([*events, *[Quiet()] * 3], JudgeLater(KEY, DecodeSettings(), asked=2))
    assert told.looks


def test_notices_are_passed_on():
    _, told = watch_of([Notice("the camera has dropped"), *poses(None, 2.0)])
    assert told.notices == ["the camera has dropped"]


def test_a_source_that_shows_nothing_gives_no_answer():
    watch, told = watch_of([Quiet(), Quiet()])
    assert watch.best is None
    assert told.looks == []


def test_a_long_watch_keeps_and_reads_its_end_alone(monkeypatch):
    monkeypatch.setattr(watching, "piece_length_s", lambda scheme: 7.0)
    silent = poses(None, 9.0)
    later = [replace(pose, time_s=pose.time_s + 9.04) for pose in poses()]
    watch, told = watch_of([*silent, *later])
    assert watch.is_decided
    assert "last" in told.notices[0]
    (track,) = watch.best.tracks
    assert track.times_s[-1] - track.times_s[0] <= 7.0
    assert len(told.notices) == 1


def test_a_glance_leaves_out_what_shows_nothing(monkeypatch):
    monkeypatch.setattr(judging, "decode_tracks", lambda *_: pytest.fail("was decoded"))
    silent = Seen(tuple(tracks_of(poses(None), 4.0)))
    assert judge(Look(3, 4.0, 20), silent, KEY, DecodeSettings()).decoding is None


def test_now_and_then_a_look_is_more_than_a_glance():
    silent = Seen(tuple(tracks_of(poses(None), 4.0)))
    assert judge(Look(8, 4.0, 90), silent, KEY, DecodeSettings()).decoding.verdict == "absent"


def test_what_cannot_be_read_is_a_refusal_and_no_end():
    still = Seen(tuple(tracks_of([Pose("robot0", 0.1 * k, 1.0, np.nan) for k in range(20)], 4.0)))
    judged = judge(Look(8, 4.0, 90), still, KEY, DecodeSettings())
    assert judged.decoding is None
    assert judged.refusal


@pytest.mark.parametrize(("late_s", "verdict"), [(0.0, "decoded"), (3600.0, "absent")])
def test_a_rolling_schedule_is_read_by_the_time_of_day(late_s, verdict):
    """What was seen first was seen a second before noon, whatever the sender's clock said."""
    sent = [
        Pose(track.name, 500.0 + float(time_s), float(x), float(y))
        for track in rolling_tracks()
        for time_s, (x, y) in zip(track.times_s[::4], track.positions[::4], strict=True)
    ]
    sent.sort(key=lambda pose: pose.time_s)
    judge = JudgeLater(ROLLING, DecodeSettings(), asked=500)
    watch, _ = watch_of(sent, judge, ROLLING, wall=lambda: NOON_S - 1.0 + late_s, wall_error_s=2.0, most_s=14.0)
    assert watch.best.decoding.verdict == verdict
    assert watch.best.decoding.message == (1234 if verdict == "decoded" else None)
