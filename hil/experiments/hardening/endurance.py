"""A day of one robot in simulated time: the onboard software over the whole CAN protocol, and what it consumes.

The schedule is rolling, and midnight falls into the middle of the run. The motion of the minute before each checkpoint
is kept, and the message is decoded from it after the run.
"""

import os
import tempfile
import time
from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Self

import numpy as np

from hil.fleet.clock import SimulatedClock
from hil.fleet.rig import LIMITS, SAMPLE_PERIOD_S
from hil.plants.mecanum import MecanumPlant, calibrated_parameters
from hil.sensors.motion_capture import MotionCapture, capture
from hil.sensors.poses import Floats, Trajectory
from hil.vehicles.can_node import CanMotionController
from hil.vehicles.motion_controller import MotionController
from hil.wires.can_line import can_line
from hil.worlds.robomaster import Route
from hil.worlds.tasks import TASKS
from mtm_audit.decoding.decode import decode_tracks
from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.model.recorded_at import RecordedAt
from mtm_onboard.journal.journal import DEFAULT_MAX_BYTES, Journal, JournalHeader
from mtm_onboard.links.reconnecting import ReconnectingLink
from mtm_onboard.links.robomaster_can import RoboMasterCan
from mtm_onboard.protocol import Channel, Key, MtmError, Scheme
from mtm_onboard.protocol.journal_file import segments
from mtm_onboard.protocol.slots import EPOCH_S, next_slot, slot_at, slot_start_unix_s
from mtm_onboard.runtime.guard import Guard, Staleness, body_sigmas
from mtm_onboard.runtime.loop import LoopStats, run_loop
from mtm_onboard.runtime.message import PlainMessage
from mtm_onboard.runtime.modulator import Modulator
from mtm_onboard.runtime.source import HeldSource
from mtm_onboard.runtime.tick import Runtime

FILM_S = 60.0
SYMBOLS = (2, 0, 3)

# Three windows of two seconds; whole messages to the day.
_SCHEME = Scheme(
    name="endurance",
    rate_hz=50.0,
    band_hz=(0.5, 5.0),
    alphabet_size=4,
    message_ticks=300,
    channels=(Channel("robot0", "robot0", ("vx", "vy"), len(SYMBOLS), 0.1),),
    schedule="rolling",
)
_KEY = Key("endurance", b"simulated, so this is no secret.", _SCHEME)
_MIDNIGHT_UNIX_S = 20_000.0 * EPOCH_S
_FILM_SAMPLES = round(FILM_S / SAMPLE_PERIOD_S)


@dataclass(frozen=True, kw_only=True)
class Checkpoint:
    """The state at `elapsed_s` of simulated time, and the message as decoded from the minute before.

    `clamped` ticks reached a limit, `disturbed` ones were stale, refused, held or not sent. `faults` counts what either
    end of the wire found wrong, lost links included. `resident_bytes` is the memory of the whole process,
    `journal_bytes` that of the journal's files together. `symbols_right` is how many of the message's symbols were read
    right, and `p_value` how unlikely the evidence would be without a message.
    """

    elapsed_s: float
    ticks: int
    missed: int
    clamped: int
    disturbed: int
    faults: int
    resident_bytes: int
    journal_bytes: int
    journal_lost: int
    cpu_s: float
    symbols_right: int = 0
    p_value: float = 1.0


def endure(
    seconds: float,
    checkpoints: int,
    seed: int,
    reached: Callable[[float], None],
    *,
    detector: str = "matched",
    journal_bytes: int = DEFAULT_MAX_BYTES,
) -> list[Checkpoint]:
    """The checkpoints, evenly spaced, of a run of that length; `reached` is called with the simulated time of each.

    Raises MtmError when checkpoints are less than a minute apart.
    """
    apart_s = seconds / checkpoints
    if apart_s < FILM_S:
        raise MtmError(f"checkpoints are {apart_s:g} s apart; ask for fewer, so that a minute lies between them")
    begin_unix_s = _begin_unix_s(apart_s * (checkpoints // 2 or 1))
    # Filled at once, so that the process takes no further memory for it during the run.
    films: Floats = np.full((checkpoints, _FILM_SAMPLES, 3), np.nan)
    states = []
    with tempfile.TemporaryDirectory() as folder, _Robot(Path(folder), begin_unix_s, seed, journal_bytes) as robot:
        for number, film in enumerate(films, 1):
            robot.run_until(number * apart_s, film)
            states.append(robot.state())
            reached(number * apart_s)
    found = []
    for number, (state, film) in enumerate(zip(states, films, strict=True), 1):
        right, p_value = _read(film, begin_unix_s + number * apart_s - FILM_S, seed, detector)
        found.append(replace(state, symbols_right=right, p_value=p_value))
    return found


def _begin_unix_s(middle_s: float) -> float:
    """The start of a slot for which midnight falls half a minute before `middle_s` of the run."""
    return slot_start_unix_s(slot_at(_MIDNIGHT_UNIX_S - middle_s + FILM_S / 2.0, _SCHEME), _SCHEME)


class _Robot:
    """The onboard software with its journal, the wire and the robot; leaving its block stops the robot."""

    def __init__(self, folder: Path, begin_unix_s: float, seed: int, journal_bytes: int) -> None:
        self._clock = clock = SimulatedClock()
        self._plant = MecanumPlant(calibrated_parameters(), seed)
        ours, theirs = can_line()
        self._node = CanMotionController(MotionController(self._plant), theirs)
        self._link = ReconnectingLink(lambda: RoboMasterCan(ours, clock=clock), clock)
        self._task = TASKS["orbit"](Route((0.0, 0.0), ()), seed)
        rate_hz = _SCHEME.rate_hz
        header = JournalHeader(
            fingerprint=_SCHEME.fingerprint,
            key_id=_KEY.id,
            robot="robot0",
            channel="robot0",
            symbols=SYMBOLS,
            repeat=True,
            rate_hz=rate_hz,
            start_s=0.0,
            start_unix_s=begin_unix_s,
        )
        self._journal = Journal(folder / "robot0.csv", header, threaded=False, max_bytes=journal_bytes)
        self._guard = Guard(LIMITS, Staleness(), noise_sigma=body_sigmas(_SCHEME.channels[:1]), period_s=1.0 / rate_hz)
        modulator = Modulator(_KEY.codebook(next_slot(begin_unix_s, _SCHEME)), "robot0", PlainMessage(SYMBOLS))
        self._source, self._stats = HeldSource(), LoopStats()
        self._runtime = Runtime(modulator, self._guard, self._source, self._link, self._journal)
        self._film: Floats = np.empty((0, 3))
        self._film_begins = 0
        clock.every(SAMPLE_PERIOD_S, self._poll)
        clock.every(self._link.service_period_s, self._link.service)

    def __enter__(self) -> Self:
        self._link.open()
        return self

    def __exit__(self, *_: object) -> None:
        with ExitStack() as stack:
            for release in (self._journal.close, self._node.shutdown, self._link.close, self._link.stop):
                stack.callback(release)

    def run_until(self, end_s: float, film: Floats) -> None:
        """Run on to `end_s`; `film` (samples, 3) receives the poses x, y, heading of the time before that."""
        self._film = film
        self._film_begins = round(end_s / SAMPLE_PERIOD_S) - len(film)
        clock = self._clock
        run_loop(
            clock, _SCHEME.rate_hz, self._step, start_s=0.0, stop=lambda: clock.now() >= end_s - 1e-6,
            stats=self._stats,
        )  # fmt: skip

    def state(self) -> Checkpoint:
        """The checkpoint without what is decoded from the film."""
        stats, guard, journal = self._stats, self._guard, self._journal
        return Checkpoint(
            elapsed_s=self._clock.now(), ticks=stats.sent + stats.unsent, missed=stats.missed, clamped=guard.clamped,
            disturbed=guard.stale + guard.refused + guard.held + guard.unsent, faults=self._faults(),
            resident_bytes=_resident_bytes(), journal_lost=journal.lost,
            journal_bytes=sum(part.stat().st_size for part in segments(journal.path)), cpu_s=time.process_time(),
        )  # fmt: skip

    def _step(self, tick: int, now_s: float, late_s: float) -> bool:
        self._source.set(self._task.command(self._plant.position_xy_m, self._plant.heading_rad), now_s)
        return self._runtime.step(tick, now_s, late_s)

    def _poll(self, now_s: float) -> None:
        self._node.poll(now_s)
        # The sample at the very beginning belongs to the film before.
        sample = round(now_s / SAMPLE_PERIOD_S) - self._film_begins - 1
        if 0 <= sample < len(self._film):
            self._film[sample] = (*self._plant.position_xy_m, self._plant.heading_rad)

    def _faults(self) -> int:
        node, link = self._node, self._link
        count = node.faults + node.ignored_messages + node.malformed_messages + node.bus_errors
        count += link.losses + link.dropped + node.controller.deadman_stops
        own = link.link
        if isinstance(own, RoboMasterCan):
            count += own.bus_errors + own.refusals + own.malformed_pushes + own.missed_heartbeats
        return count


def _read(film: Floats, begin_unix_s: float, seed: int, detector_name: str) -> tuple[int, float]:
    """The number of symbols decoded correctly from one film, which begins at `begin_unix_s`, and the p-value."""
    begin_unix_s += SAMPLE_PERIOD_S
    times_s = np.arange(len(film), dtype=np.float64) * SAMPLE_PERIOD_S
    trajectory = Trajectory("robot0", times_s, film[:, :2], film[:, 2])
    (track,) = capture(MotionCapture(), [trajectory], np.random.default_rng(seed))
    slot = next_slot(begin_unix_s, _SCHEME)
    onset_s = slot_start_unix_s(slot, _SCHEME) - begin_unix_s
    settings = DecodeSettings(detector=detector_name, onset_s=onset_s, at=RecordedAt(begin_unix_s))
    decoding = decode_tracks([track], _KEY, settings)
    right = sum(read == sent for read, sent in zip(decoding.symbols, SYMBOLS, strict=True))
    return right, decoding.evidence.p_value


def _resident_bytes() -> int:
    return int(Path("/proc/self/statm").read_text().split()[1]) * os.sysconf("SC_PAGE_SIZE")
