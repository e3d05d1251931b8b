"""`mtm-onboard run`: the runtime in real time on the robot."""

import argparse
import gc
import math
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mtm_onboard.config import RobotConfig, SourceSettings
    from mtm_onboard.guard import Guard
    from mtm_onboard.loop import LoopStats
    from mtm_onboard.protocol import Key
    from mtm_onboard.source import Source

# Between opening the link and the message's first tick, so that the loop is running by then.
_LEAD_S = 0.1
_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)


def add_parser(subparsers: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command and its options."""
    parser = subparsers.add_parser("run", help="drive the robot: base commands in, base commands and message out")
    parser.add_argument("--config", required=True, type=Path, help="the robot's configuration (TOML)")
    parser.add_argument("--key", required=True, type=Path, help="the key file")
    message = parser.add_mutually_exclusive_group(required=True)
    message.add_argument("--message", type=int, metavar="N", help="the message as a number")
    message.add_argument("--symbols", type=_symbols, metavar="S,S,...", help="the whole message as symbols")
    message.add_argument("--no-message", action="store_true", help="base commands alone, without noise")
    parser.add_argument("--no-repeat", action="store_true", help="send the message once, then base commands alone")
    parser.add_argument("--duration", type=_seconds, metavar="S", help="end this long after the message's start")
    parser.add_argument(
        "--start-at", type=_seconds, metavar="T",
        help="the message's start in seconds since the Unix epoch, the same for robots that start together (now)",
    )  # fmt: skip
    parser.add_argument("--stdin", action="store_true", help="base commands from standard input, not the [source]")
    parser.set_defaults(handler=_run)


def _run(args: argparse.Namespace) -> int:
    from mtm_onboard.config import SourceSettings, load_config
    from mtm_onboard.protocol import load_key

    config, key = load_config(args.config), load_key(args.key)
    settings = SourceSettings("stdin") if args.stdin else config.source
    message = _message(args, key)
    with _ending_signals() as asked_to_end:
        print(_drive(args, config, key, settings, message, asked_to_end))
    return 0


def _message(args: argparse.Namespace, key: "Key") -> tuple[int, ...] | None:
    from mtm_onboard.protocol.framing import check_symbols, symbols_of_number

    if args.no_message:
        return None
    if args.symbols is not None:
        return check_symbols(args.symbols, key.scheme)
    return symbols_of_number(args.message, key.scheme)


def _drive(
    args: argparse.Namespace,
    config: "RobotConfig",
    key: "Key",
    settings: "SourceSettings",
    message: tuple[int, ...] | None,
    asked_to_end: Callable[[], bool],
) -> str:
    from mtm_onboard.clock import SystemClock
    from mtm_onboard.guard import Guard
    from mtm_onboard.journal import Journal, JournalHeader
    from mtm_onboard.loop import LoopStats, run_loop
    from mtm_onboard.modulator import Modulator
    from mtm_onboard.protocol import MtmError
    from mtm_onboard.protocol.framing import channel_symbols
    from mtm_onboard.runtime import Runtime
    from mtm_onboard.service import ServiceThread
    from mtm_onboard.transports.factory import make_transport

    scheme, robot = key.scheme, config.robot
    channel = scheme.channel(robot.channel)
    modulator = None
    if message is not None:
        own = channel_symbols(message, scheme)[channel.name]
        modulator = Modulator(key.codebook(), channel.name, own, repeat=not args.no_repeat)
    guard = Guard(config.limits, config.staleness, noise_sigma=channel.sigma, period_s=1 / scheme.rate_hz)
    clock, stats = SystemClock(), LoopStats()
    transport = make_transport(config.transport_kind, config.transport_options)

    # The stack closes in reverse: the robot is told to stop before a slow disk or a socket is waited for.
    with ExitStack() as stack:
        source = _make_source(settings)
        stack.callback(source.close)
        files = stack.enter_context(ExitStack())
        stack.enter_context(transport)
        service = stack.enter_context(ServiceThread(transport, clock))
        now_s, now_unix_s = clock.now(), time.time()
        start_unix_s = now_unix_s + _LEAD_S if args.start_at is None else args.start_at
        start_s = now_s + start_unix_s - now_unix_s
        end_s = math.inf if args.duration is None else start_s + args.duration
        journal = None
        if config.journal is not None:
            header = JournalHeader(
                scheme.fingerprint, key.id, robot.name, channel.name, message, not args.no_repeat, scheme.rate_hz,
                start_s, start_unix_s,
            )  # fmt: skip
            journal = files.enter_context(Journal(Path(config.journal.path), header, threaded=True))
        runtime = Runtime(modulator, guard, source, transport, journal)

        def ending() -> bool:
            return asked_to_end() or service.error is not None or clock.now() >= end_s

        with _collected_garbage():
            run_loop(clock, scheme.rate_hz, runtime.step, start_s=start_s, stop=ending, stats=stats)
        if service.error is not None:
            raise MtmError(f"the robot's link failed ({service.error}); check the link") from service.error
    return _summary(stats, guard, source, None if journal is None else f"{journal.path}, {journal.lost} rows lost")


def _make_source(settings: "SourceSettings") -> "Source":
    from mtm_onboard.source import StdinSource, UdpSource

    return StdinSource() if settings.port is None else UdpSource(settings.port)


def _summary(stats: "LoopStats", guard: "Guard", source: "Source", journal: str | None) -> str:
    late_ms = [1e3 * stats.lateness.quantile_s(part) for part in (0.5, 0.99)]
    return (
        f"{stats.sent} ticks sent, {stats.missed} missed, {guard.clamped} clamped, {guard.stale} stale, "
        f"{source.refused + guard.refused} commands refused, late p50 {late_ms[0]:.3f} ms p99 {late_ms[1]:.3f} ms"
        + (f", journal {journal}" if journal else "")
    )


@contextmanager
def _ending_signals() -> Iterator[Callable[[], bool]]:
    """Yield a question that is true once the process was asked to end; the former handlers come back after it."""
    asked = False

    def ask(*_: object) -> None:
        nonlocal asked
        asked = True

    former = {number: signal.signal(number, ask) for number in _SIGNALS}
    try:
        yield lambda: asked
    finally:
        for number, handler in former.items():
            signal.signal(number, handler)


@contextmanager
def _collected_garbage() -> Iterator[None]:
    """Keep what is alive now out of later collections, so that none of them takes milliseconds of a tick."""
    gc.collect()
    gc.freeze()
    try:
        yield
    finally:
        gc.unfreeze()


def _symbols(text: str) -> tuple[int, ...]:
    return tuple(int(symbol) for symbol in text.split(","))


def _seconds(text: str) -> float:
    value = float(text)
    if not (math.isfinite(value) and value >= 0):
        raise ValueError
    return value
