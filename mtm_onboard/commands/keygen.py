"""`mtm-onboard keygen`: a fresh secret and its scheme: a master, or under a fixed schedule a key of format 1."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mtm_onboard.commands.dayoptions import add_days, first_day

if TYPE_CHECKING:
    from mtm_onboard.protocol import Channel, Scheme
    from mtm_onboard.protocol.framing import Framing

_PRESETS: dict[str, dict[str, Any]] = {
    # 8 bits with a tag in the 12 s of the paper's 8 bits: more symbols, each in a third of the time.
    "robomaster-fleet": {
        "name": "robomaster-fleet",
        "rate": 50.0,
        "band": (0.5, 5.0),
        "alphabet": 16,
        "message_ticks": 600,
        "channel": [f"robot{number}:vx,vy:3:0.1" for number in range(4)],
        "power": "window",
        "payload": ("integer", 8),
        "number_bits": 4,
        "check": ("tag", 24),
        "code": "reed-solomon",
        "interleave": True,
    },
    # 6 bits/s a robot: a large alphabet in short windows, and nearly half of the symbols parity.
    "fast": {
        "name": "fast",
        "rate": 50.0,
        "band": (0.5, 5.0),
        "alphabet": 4096,
        "message_ticks": 400,
        "channel": [f"robot{number}:vx,vy:4:0.1" for number in range(4)],
        "power": "window",
        "payload": ("integer", 64),
        "number_bits": 8,
        "check": ("tag", 32),
        "code": "reed-solomon",
        "interleave": True,
    },
    # A robot on two driven wheels, whose turning follows to 2-3 Hz and its speed to 1 Hz: a fifth of the paper's noise.
    "quiet": {
        "name": "quiet",
        "rate": 50.0,
        "band": (0.5, 2.5),
        "alphabet": 256,
        "message_ticks": 3600,
        "channel": ["speed:vx:6:0.02:robot0", "turn:wz:6:0.1:robot0"],
        "combine": "same",
        "power": "window",
        "payload": ("integer", 8),
        "check": ("tag", 24),
        "code": "reed-solomon",
    },
    # As in the paper: without a tag, and with waveforms that come again.
    "paper-robomaster-fleet": {
        "name": "robomaster-fleet",
        "rate": 50.0,
        "band": (0.5, 5.0),
        "alphabet": 4,
        "message_ticks": 600,
        "channel": [f"robot{number}:vx,vy:1:0.1" for number in range(4)],
        "power": "window",
        "schedule": "fixed",
    },
}
# Ten years, leap days included.
_USUAL_DAYS = 3653
_REQUIRED = ("name", "rate", "band", "alphabet", "message_ticks", "channel")
_CHOSEN_BY_SCHEME = ("combine", "pooling", "power", "schedule", "epoch")
_FLAT = "flat"
# Widths of a tag, the first that fits being taken where none is asked for.
_TAG_BITS = (32, 24, 16)
_FRAMING = ("payload", "number_bits", "check", "code", "interleave")


def add_parser(subparsers: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command and its options."""
    parser = subparsers.add_parser("keygen", help="make a key file: a secret and the scheme it is for")
    parser.add_argument("--id", required=True, metavar="NAME", help="the key's name, which journals and auditors show")
    parser.add_argument(
        "--out", required=True, type=Path, metavar="FILE", help="the key file to write; it must not exist"
    )
    parser.add_argument("--preset", choices=sorted(_PRESETS), help="a whole scheme; the options below override parts")
    parser.add_argument("--scheme", type=Path, metavar="FILE", help="a scheme file, as mtm-audit plan writes it")
    parser.add_argument("--name", metavar="NAME", help="the scheme's name")
    parser.add_argument("--rate", type=float, metavar="HZ", help="control rate")
    parser.add_argument("--band", type=_band, metavar="LOW:HIGH", help="noise band in Hz, such as 0.5:5")
    parser.add_argument("--alphabet", type=int, metavar="M", help="number of different symbols")
    parser.add_argument("--message-ticks", type=int, metavar="T", help="length of a message in control periods")
    parser.add_argument(
        "--channel", action="append", metavar="NAME:AXES:SYMBOLS:SIGMA[:BODY]",
        help="a channel, such as robot0:vx,vy:1:0.1, once for each; SIGMA may be one for each axis, as 0.1,0.1,0.2; "
        "the body is named like the channel unless given",
    )  # fmt: skip
    parser.add_argument(
        "--combine", metavar="split|same", help="split (default): each channel carries its part; same: all carry all"
    )
    parser.add_argument(
        "--pooling",
        metavar="mean|majority",
        help="how auditors pool channels that carry the same: mean (default) or majority",
    )
    parser.add_argument(
        "--power",
        metavar="window|ensemble",
        help="window (default): each window has mean square 1; ensemble: Gaussian samples",
    )
    parser.add_argument(
        "--spectrum",
        type=_points,
        metavar="HZ:DB,HZ:DB",
        help="power over the band by points, such as 0.5:0,5:-6, or flat (default); the total stays the same",
    )
    parser.add_argument(
        "--schedule",
        metavar="rolling|fixed",
        help="rolling (default): no waveform is played twice; fixed: they come again",
    )
    parser.add_argument("--epoch", type=int, metavar="N", help="number of the first epoch (0)")
    add_days(parser, _USUAL_DAYS)
    _add_framing(parser)
    parser.set_defaults(handler=_keygen, usage_error=parser.error)


def _add_framing(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group(
        "framing", "under a rolling schedule messages have a tag of 32, 24 or 16 bits, what fits, unless --check says "
        "otherwise; without --payload the rest of a message is a number",
    )  # fmt: skip
    group.add_argument(
        "--payload", type=_sized, metavar="KIND:SIZE", help="integer:BITS, bytes:BYTES or text:BYTES, such as text:16"
    )
    group.add_argument("--number-bits", type=int, metavar="BITS", help="carry the message's number, modulo 2**BITS (0)")
    group.add_argument(
        "--check", type=_sized, metavar="KIND:BITS", help="crc:BITS or tag:BITS, such as tag:32, or none"
    )
    group.add_argument(
        "--code",
        metavar="none|reed-solomon",
        help="none (default), or reed-solomon: whatever is left free becomes parity",
    )
    group.add_argument("--interleave", action="store_true", default=None, help="deal symbols over channels and time")


def _keygen(args: argparse.Namespace) -> int:
    from mtm_onboard.protocol import generate_key, save_key
    from mtm_onboard.protocol.errors import command_line_values
    from mtm_onboard.protocol.key import generate_master
    from mtm_onboard.protocol.schemefile import load_scheme

    given = {name: getattr(args, name) for name in (*_REQUIRED, *_CHOSEN_BY_SCHEME, "spectrum", *_FRAMING)}
    if args.scheme is None:
        with command_line_values():
            scheme = _chosen_scheme(args, given)
    elif args.preset is not None or any(value is not None for value in given.values()):
        args.usage_error("--scheme gives the whole scheme; leave out --preset and the options for its parts")
    else:
        scheme = load_scheme(args.scheme)
    if scheme.schedule == "fixed":
        save_key(generate_key(args.id, scheme), args.out)
        print(f"wrote key {args.id} to {args.out} (scheme {scheme.fingerprint}); keep it secret")
        return 0
    key = generate_master(args.id, scheme, first_day(args), args.days)
    save_key(key, args.out)
    grant = key.holding.grant
    assert grant is not None
    print(
        f"wrote master {args.id} to {args.out} (scheme {scheme.fingerprint}), for {grant.first_day} to "
        f"{grant.last_day}; keep it secret and apart, and give robots and auditors what mtm-onboard issue cuts from it"
    )
    return 0


def _chosen_scheme(args: argparse.Namespace, given: dict[str, Any]) -> "Scheme":
    from dataclasses import replace

    from mtm_onboard.protocol import Scheme

    chosen = {"schedule": "rolling"} | _PRESETS.get(args.preset, {})
    chosen |= {name: value for name, value in given.items() if value is not None}
    missing = [f"--{name.replace('_', '-')}" for name in _REQUIRED if name not in chosen]
    if missing:
        args.usage_error(f"without --preset or --scheme these are needed: {', '.join(missing)}")
    scheme = Scheme(
        name=chosen["name"], rate_hz=chosen["rate"], band_hz=chosen["band"], alphabet_size=chosen["alphabet"],
        message_ticks=chosen["message_ticks"], channels=tuple(_channel(text) for text in chosen["channel"]),
        spectrum=chosen.get("spectrum") or None,
        **{name: chosen[name] for name in _CHOSEN_BY_SCHEME if name in chosen},
    )  # fmt: skip
    asked = {name: chosen[name] for name in _FRAMING if name in chosen}
    if scheme.schedule == "rolling" and "check" not in asked:
        return _tagged(args, scheme, asked)
    return replace(scheme, framing=_framing(args, asked))


def _tagged(args: argparse.Namespace, scheme: "Scheme", asked: dict[str, Any]) -> "Scheme":
    """The scheme with the widest tag that fits beside the payload, or with a number in what a tag leaves over."""
    from dataclasses import replace

    from mtm_onboard.protocol import MtmError
    from mtm_onboard.protocol.framing import payload_bits

    refusal = None
    for bits in _TAG_BITS:
        left = payload_bits(scheme) - bits - asked.get("number_bits", 0)
        payload = asked.get("payload", ("integer", max(1, min(64, left))))
        try:
            return replace(scheme, framing=_framing(args, asked | {"payload": payload, "check": ("tag", bits)}))
        except MtmError as error:
            refusal = error
    raise MtmError(
        f"there is no room for a tag ({refusal}); or say --check none, after which nothing "
        "shows that the message was read right, or take a preset of the paper"
    )


def _framing(args: argparse.Namespace, chosen: dict[str, Any]) -> "Framing | None":
    from mtm_onboard.protocol.framing import Framing

    if not chosen or (chosen.keys() == {"check"} and chosen["check"] == ("none", 0)):
        return None
    if "payload" not in chosen:
        args.usage_error("a framing needs --payload, such as --payload integer:64")
    payload, size = chosen.pop("payload")
    chosen["check"], chosen["check_bits"] = chosen.get("check", ("none", 0))
    return Framing(payload, size if payload == "integer" else 8 * size, **chosen)


def _sized(text: str) -> tuple[str, int]:
    if text == "none":
        return text, 0
    kind, size = text.split(":")
    return kind, int(size)


def _band(text: str) -> tuple[float, float]:
    low, high = text.split(":")
    return float(low), float(high)


def _points(text: str) -> tuple[tuple[float, float], ...]:
    """The points of a spectrum; none at all for a flat one."""
    if text == _FLAT:
        return ()
    pairs = [part.split(":") for part in text.split(",")]
    return tuple((float(frequency), float(level)) for frequency, level in pairs)


def _sigma(text: str) -> float | tuple[float, ...]:
    values = tuple(float(value) for value in text.split(","))
    return values[0] if len(values) == 1 else values


def _channel(text: str) -> "Channel":
    from mtm_onboard.protocol import Channel, MtmError

    parts = text.split(":")
    try:
        name, axes, symbols, sigma, *body = parts
        (body_name,) = body or [name]
        return Channel(name, body_name, tuple(axes.split(",")), int(symbols), _sigma(sigma))
    except ValueError as error:
        raise MtmError(f"the channel {text!r} is not NAME:AXES:SYMBOLS:SIGMA[:BODY]; see keygen --help") from error
