"""Watches on simulated time, for the tests: a robot that sends, and what is told of it."""

from dataclasses import dataclass, field

from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.live.events import Pose
from mtm_audit.live.judges import JudgeHere
from mtm_audit.live.watching import Poses, Watch
from tests.audit.moving_robot import key_of, robot_track, scheme_of

KEY = key_of(scheme_of(symbols=(1,), ticks=200))
SECONDS = 10.0


def poses(symbols=(2,), seconds=SECONDS, key=KEY, begin_s=0.0, rate_hz=25.0):
    track = robot_track(key, "robot0", symbols, seconds, onset_s=1.0, rate_hz=rate_hz)
    return [
        Pose("robot0", begin_s + float(time_s), float(x), float(y))
        for time_s, (x, y) in zip(track.times_s, track.positions, strict=True)
    ]


@dataclass
class Told:
    """An audience that keeps what it is told."""

    looks: list = field(default_factory=list)
    notices: list = field(default_factory=list)
    events: int = 0

    def shown(self, event, watched_s):
        self.events += 1

    def noticed(self, sentence):
        self.notices.append(sentence)

    def judged(self, judged):
        self.looks.append(judged)


class JudgeLater(JudgeHere):
    """Finishes a look after it was asked for it so many times."""

    def __init__(self, key, settings, asked):
        super().__init__(key, settings)
        self.left, self.asked = 0, asked

    def begin(self, look, seen):
        super().begin(look, seen)
        self.left = self.asked

    def finished(self):
        self.left -= 1
        return None if self.left > 0 else super().finished()

    def wait(self):
        self.left = 0


def watch_of(events, judge=None, key=KEY, **options):
    told = Told()
    watch = Watch(key.scheme, Poses(), judge or JudgeHere(key, DecodeSettings()), told, **options)
    watch.run(events)
    return watch, told
