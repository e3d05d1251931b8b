"""One run of a robot in real time: everything put together, from opening its link to its last stop."""

import gc
import math
import sys
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from itertools import count
from pathlib import Path

from mtm_onboard.control.control import Control, Session
from mtm_onboard.control.control_socket import ControlSocket
from mtm_onboard.control.run_ledger import ledger_of_run
from mtm_onboard.control.service_manager import ServiceManager
from mtm_onboard.control.slot_watch import Playing, SlotWatch, utc
from mtm_onboard.control.state_log import StateLog, named
from mtm_onboard.journal.journal import Journal, JournalHeader
from mtm_onboard.links.base import Link
from mtm_onboard.links.factory import make_link
from mtm_onboard.links.reconnecting import ReconnectingLink
from mtm_onboard.model.clock import Clock, SystemClock
from mtm_onboard.model.wall_clock import SimulatedWallClock, SystemWallClock, WallClock
from mtm_onboard.protocol import Key, MtmError, Scheme
from mtm_onboard.protocol.slots import next_slot, slot_start_unix_s
from mtm_onboard.runtime.config import RobotConfig, SourceSettings
from mtm_onboard.runtime.datagram_source import UdpSource, UnixSource
from mtm_onboard.runtime.guard import Guard, body_sigmas
from mtm_onboard.runtime.loop import LoopStats, run_loop
from mtm_onboard.runtime.message import SILENCE, Content, Played, Silence, message_of
from mtm_onboard.runtime.modulator import Modulator
from mtm_onboard.runtime.realtime import realtime
from mtm_onboard.runtime.service import ServiceThread
from mtm_onboard.runtime.source import Source, StdinSource
from mtm_onboard.runtime.tick import Runtime

# Between opening the link and the message's first tick, so that the loop is running by then.
_LEAD_S = 0.1
# The year 2024: a clock that shows less was never set since the power came on.
_EARLIEST_UNIX_S = 1_704_067_200.0


@dataclass(frozen=True)
class Plan:
    """What to send and when: the message, from `start_unix_s` (None: at once) on.

    Without a message there is silence until the run is sent one. Under the rolling schedule the start is the next
    slot's. The run ends `duration_s` after the message's start;
    without `repeat` the message is sent once. `allow_unsynchronised` lets a rolling schedule follow a clock that nobody
    keeps right, and be played without a ledger, as in a lab.
    """

    message: Content | None
    repeat: bool = True
    start_unix_s: float | None = None
    duration_s: float = math.inf
    allow_unsynchronised: bool = False


@dataclass(frozen=True, kw_only=True)
class Ends:
    """Where base commands come from and where commands go, when the caller has both already, and names for them.

    `stop_by` says how the operator stops the robot. `clock` says what the time is for the ticks; `simulated` that it is
    not this computer's. `wall` is the time of day where that is not this computer's either; the ledger is then written
    by the loop itself.
    """

    source: Source
    transport: Link
    clock: Clock
    simulated: bool
    source_name: str
    link_name: str
    stop_by: str
    wall: WallClock | None = None


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """What the run did. `journal` is None when none was kept."""

    stats: LoopStats
    guard: Guard
    source: Source
    journal: Journal | None
    link_losses: int = 0
    link_degradations: int = 0
    link_counters: dict[str, int] = field(default_factory=dict)

    def summary(self) -> str:
        """All of it in one line."""
        guard, late_ms = self.guard, [1e3 * self.stats.lateness.quantile_s(part) for part in (0.5, 0.99)]
        kept = f", journal {self.journal.path}, {self.journal.lost} rows lost" if self.journal else ""
        counted = [f"{name.replace('_', ' ')} {count}" for name, count in self.link_counters.items() if count]
        return (
            f"{self.stats.sent} ticks sent, {self.stats.unsent} unsent, {self.stats.missed} missed, "
            f"{self.stats.overruns} over their period, "
            f"{guard.clamped} clamped, {guard.stale} stale, {self.link_losses} link losses, "
            f"{self.link_degradations} times degraded, {self.source.refused + guard.refused} commands refused, "
            f"late p50 {late_ms[0]:.3f} ms p99 {late_ms[1]:.3f} ms{kept}"
            + (f"; the link counted: {', '.join(counted)}" if counted else "")
        )


def run_session(
    config: RobotConfig,
    key: Key,
    plan: Plan,
    asked_to_end: Callable[[], bool],
    ends: Ends | None = None,
    say: Callable[[str], None] = lambda sentence: None,
) -> Outcome:
    """Drive the robot until `asked_to_end()` or the plan's end; leaving it, in whatever way, stops the robot.

    `ends`, when given, take the place of the source and the transport that the configuration names. `say` is told at
    the start what the run is, and from another thread one sentence at each change of its state.
    Raises MtmError when the plan does not fit the key or starts in the past, when the link, the control socket or the
    journal cannot be had, and when the link fails.
    """
    channel, rate_hz = key.scheme.channel(config.robot.channel), key.scheme.rate_hz
    rolling = key.scheme.schedule == "rolling"
    # Before anything moves, so that whatever does not fit is found; a rolling message then gets its true slot.
    grant = key.holding.grant
    modulator = _modulator(key, channel.name, plan, 0 if grant is None else grant.first_slot(key.scheme))
    clock, stats = SystemClock() if ends is None else ends.clock, LoopStats()
    wall = _wall(ends)
    _check_start(plan, wall.unix_s(), rolling=rolling)
    if grant is not None:
        grant.check_unexpired(wall.unix_s())
    guard = Guard(config.limits, config.staleness, noise_sigma=body_sigmas([channel]), period_s=1 / rate_hz)
    transport = _link(config, clock) if ends is None else ends.transport
    # The stack closes in reverse: the robot is told to stop before a socket or a slow disk is waited for.
    with ExitStack() as stack:
        # From the start, so that no heartbeat is late while the rest is made.
        place_threads = stack.enter_context(realtime(config.realtime, _warn))
        source = _source(config.source) if ends is None else ends.source
        stack.callback(source.close)
        files = stack.enter_context(ExitStack())
        ledger = ledger_of_run(config, key, wall, allow_unsynchronised=plan.allow_unsynchronised)
        if ledger is not None:
            files.enter_context(ledger)
        take_number = count().__next__ if ledger is None else ledger.take_number
        played = SILENCE if plan.message is None else message_of(plan.message, key, take_number())
        for sentence in introduction(config, key, played, ends):
            say(sentence)
        socket = None if config.control is None else files.enter_context(ControlSocket(Path(config.control.socket)))
        stack.enter_context(transport)
        service = stack.enter_context(ServiceThread(transport, clock))
        # Before the service's thread is waited for, which a wedged driver may hold.
        stack.callback(transport.stop)
        now_s, now_unix_s = clock.now(), wall.unix_s()
        last_slot = -1 if ledger is None else ledger.last_slot
        start_unix_s, first_slot = start_of(plan, key.scheme, now_unix_s, last_slot)
        modulator = _planned(key, channel.name, plan, played, first_slot)
        start_s = now_s + start_unix_s - now_unix_s
        journal = None
        if config.journal is not None:
            header = JournalHeader(
                fingerprint=key.scheme.fingerprint, key_id=key.id, robot=config.robot.name, channel=channel.name,
                symbols=None if isinstance(played, Silence) else played.symbols(first_slot),
                repeat=plan.repeat, rate_hz=rate_hz, start_s=start_s,
                start_unix_s=None if isinstance(wall, SimulatedWallClock) else start_unix_s,
            )  # fmt: skip
            journal = files.enter_context(
                Journal(
                    Path(config.journal.path),
                    header,
                    threaded=True,
                    max_bytes=int(1e6 * config.journal.max_mb),
                    hides_noise=True,
                )
            )
        runtime = Runtime(modulator, guard, source, transport, journal)
        playing = Playing(modulator=modulator, first_tick=0, first_slot=first_slot, start_unix_s=start_unix_s)
        watch = None
        if rolling:
            watch = SlotWatch(
                playing, scheme=key.scheme, runtime=runtime, clock=clock, wall=wall, start_s=start_s, ledger=ledger,
                play=lambda message, slot: _planned(key, channel.name, plan, message, slot),
                is_trusted=lambda: plan.allow_unsynchronised or wall.is_synchronised() is True,
                note=journal.note if journal is not None else _say_nowhere,
                threaded=ends is None or ends.wall is None,
            )  # fmt: skip
            # Left after the robot was told to stop, as it waits for the disk.
            files.enter_context(watch)
            if late := _lateness_sentence(plan, key.scheme, now_unix_s, start_unix_s, first_slot):
                watch.doubt = late
                if journal is not None:
                    journal.note(0, late)
        session = Session(
            robot=config.robot.name,
            key=key,
            guard=guard,
            source=source,
            transport=transport,
            stats=stats,
            journal=journal,
            now_s=clock.now,
            start_s=start_s,
            playing=(lambda: playing) if watch is None else (lambda: watch.playing),
            plays=modulator.sends if watch is None else watch.plays,
            clock_doubt=str if watch is None else (lambda: watch.doubt),
            take_number=take_number,
        )
        if socket is not None:
            socket.serve(Control(session).answer)
        # After the robot was told to stop, as all that may wait.
        files.enter_context(StateLog(session.state, say))

        # Closed first of all: whoever ends takes as long as it takes, and no watchdog is fed any more.
        manager = ServiceManager()
        stack.callback(manager.close)

        def ending() -> bool:
            now_s = clock.now()
            manager.feed(now_s)
            return asked_to_end() or service.error is not None or now_s >= start_s + plan.duration_s

        with _long_lived_objects_uncollected():
            place_threads(service.thread)
            manager.ready()
            run_loop(clock, rate_hz, runtime.step, start_s=start_s, stop=ending, stats=stats)
        if service.error is not None:
            raise MtmError(f"the robot's link failed ({service.error}); check the link") from service.error
    return Outcome(
        stats=stats,
        guard=guard,
        source=source,
        journal=journal,
        link_losses=runtime.link_losses,
        link_degradations=runtime.link_degradations,
        link_counters=transport.counters(),
    )


def _warn(text: str) -> None:
    print(f"mtm-onboard: {text}", file=sys.stderr)


def _link(config: RobotConfig, clock: Clock) -> Link:
    def make() -> Link:
        return make_link(config.transport_kind, config.transport_options)

    return ReconnectingLink(make, clock, give_up_s=config.link.give_up_s) if config.link.reconnect else make()


def start_of(plan: Plan, scheme: Scheme, now_unix_s: float, last_slot: int = -1) -> tuple[float, int]:
    """When the message starts, in seconds since the Unix epoch, and in which slot (0 under the fixed schedule).

    Under the rolling schedule a slot under way is left to its end, and so are those up to `last_slot`, which may have
    been played before: a restart plays no waveform again.
    """
    wanted_unix_s = now_unix_s + _LEAD_S if plan.start_unix_s is None else plan.start_unix_s
    if scheme.schedule == "fixed":
        return wanted_unix_s, 0
    slot = max(next_slot(max(wanted_unix_s, now_unix_s + _LEAD_S), scheme), last_slot + 1)
    return slot_start_unix_s(slot, scheme), slot


def _lateness_sentence(
    plan: Plan, scheme: Scheme, now_unix_s: float, start_unix_s: float, first_slot: int
) -> str | None:
    """What is told when slots that were played before hold the message up."""
    if first_slot == start_of(plan, scheme, now_unix_s)[1]:
        return None
    return (
        f"the slots until {utc(start_unix_s)} may have been played before, by a clock that was ahead or a run that was "
        "cut off, so the message begins only then"
    )


def _wall(ends: Ends | None) -> WallClock:
    if ends is None:
        return SystemWallClock()
    if ends.wall is not None:
        return ends.wall
    return SimulatedWallClock(ends.clock) if ends.simulated else SystemWallClock()


def _say_nowhere(tick: int, sentence: str) -> None:
    """Without a journal there is only the state log."""


def introduction(config: RobotConfig, key: Key, message: Played, ends: Ends | None) -> Iterator[str]:
    """What a run says of itself before anything moves."""
    robot, scheme = config.robot, key.scheme
    if key.warning is not None:
        yield key.warning
    yield (
        f"{robot.name} plays channel {robot.channel} of scheme {scheme.name} ({scheme.fingerprint}) with key {key.id}: "
        f"{named(message) or 'no message'}"
    )
    options = ", ".join(f"{name} {value}" for name, value in config.transport_options.items())
    link = f"{config.transport_kind}{f' ({options})' if options else ''}" if ends is None else ends.link_name
    yield f"base commands come from {config.source if ends is None else ends.source_name} and go to {link}"
    yield f"to stop the robot: {_ways_to_stop(config) if ends is None else ends.stop_by}; Ctrl-C ends the run"


def _ways_to_stop(config: RobotConfig) -> str:
    where = (
        "a line stop on standard input" if config.source.kind == "stdin" else f"the datagram stop to {config.source}"
    )
    return where if config.control is None else f"mtm-onboard stop --socket {config.control.socket}, or {where}"


def _check_start(plan: Plan, now_unix_s: float, *, rolling: bool) -> None:
    if rolling and now_unix_s < _EARLIEST_UNIX_S:
        raise MtmError(
            "this computer's clock was never set, and the rolling schedule's messages start by the time of day; "
            "set the clock, for example by NTP"
        )
    if plan.start_unix_s is not None and plan.start_unix_s <= now_unix_s:
        raise MtmError(
            f"the start is {now_unix_s - plan.start_unix_s:.3f} s in the past; give a time that is still to come, in "
            f"seconds since the Unix epoch (now is {now_unix_s:.0f})"
        )


def _planned(key: Key, channel_name: str, plan: Plan, played: Played, first_slot: int) -> Modulator:
    """What plays a message from a slot on; raises MtmError when the key is not for that slot."""
    grant = key.holding.grant
    if grant is not None and first_slot > grant.last_slot(key.scheme):
        raise MtmError(
            f"this key file is for days up to {grant.last_day}, and the message would begin after its last slot; have "
            "one issued for the days to come"
        )
    return Modulator(key.codebook(first_slot), channel_name, played, repeat=plan.repeat)


def _modulator(key: Key, channel_name: str, plan: Plan, first_slot: int) -> Modulator:
    message = SILENCE if plan.message is None else message_of(plan.message, key)
    modulator = Modulator(key.codebook(first_slot), channel_name, message, repeat=plan.repeat)
    modulator.require_body_axes()
    return modulator


def _source(settings: SourceSettings) -> Source:
    if settings.socket is not None:
        return UnixSource(Path(settings.socket))
    return StdinSource() if settings.port is None else UdpSource(settings.port)


@contextmanager
def _long_lived_objects_uncollected() -> Iterator[None]:
    """Keep what is alive now out of later garbage collections, so that none of them takes milliseconds of a tick."""
    gc.collect()
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()
