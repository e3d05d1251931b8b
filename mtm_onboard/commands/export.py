"""`mtm-onboard export`: a message as the image that a microcontroller plays."""

import argparse
import math
from pathlib import Path
from typing import TYPE_CHECKING

from mtm_onboard.commands.contentoptions import add_content, content

if TYPE_CHECKING:
    from mtm_onboard.firmware.image import Image
    from mtm_onboard.protocol import Channel, Key, Scheme

# DJI's limits for the chassis; others are options.
_SPEED_MPS = 3.5
_TURN_RATE_RADPS = 10.47
# As the guard of the companion's program has it.
_NOISE_SIGMAS = 4.0


def add_parser(subparsers: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command and its options."""
    parser = subparsers.add_parser("export", help="write a message as an image for firmware_shim")
    parser.add_argument("--key", required=True, type=Path, metavar="FILE", help="the key file")
    parser.add_argument(
        "--channel", metavar="NAME", help="the scheme's channel that the robot plays; may be left out if there is one"
    )
    add_content(parser)
    parser.add_argument("-o", "--out", required=True, type=Path, metavar="FILE", help="the image to write")
    parser.add_argument("--force", action="store_true", help="replace a file that is no image; a key file never is")
    parser.add_argument("--no-repeat", action="store_true", help="fixed schedule: play the message once")
    length = parser.add_mutually_exclusive_group()
    length.add_argument("--messages", type=int, metavar="N", help="rolling schedule: how many messages (1)")
    length.add_argument(
        "--span", type=float, metavar="SECONDS", help="rolling schedule: messages for at least this long"
    )
    parser.add_argument(
        "--first-message", type=int, metavar="N",
        help="rolling schedule: slot of the first (the next that begins; 0 for keys of format 1)",
    )  # fmt: skip
    parser.add_argument(
        "--limit-mps", type=float, metavar="MPS", default=_SPEED_MPS, help="largest |vx| and |vy| sent (%(default)s)"
    )
    parser.add_argument(
        "--limit-radps", type=float, metavar="RADPS", default=_TURN_RATE_RADPS, help="largest |wz| sent (%(default)s)"
    )
    _add_seal(parser)
    parser.set_defaults(handler=run, usage_error=parser.error)


def _add_seal(parser: argparse.ArgumentParser) -> None:
    group = parser.add_argument_group("seal", "for a device that takes only images that are sealed for it")
    group.add_argument("--device-key", type=Path, metavar="FILE", help="the device's key, of mtm-onboard device-key")
    group.add_argument("--device-channel", type=int, metavar="N", help="the device's own number (the channel's place)")
    group.add_argument(
        "--counter", type=int, metavar="N", help="higher than that of the device's last image (seconds since 1970)"
    )
    group.add_argument(
        "--noise-limit", type=float, metavar="SIGMAS", help="cut the noise at so many times the channel's sigma (4)"
    )


def run(args: argparse.Namespace) -> int:
    """Write the image with mode 0600: it holds no secret, but whoever has it can play the message."""
    from mtm_onboard.firmware.image import IMAGE_MAGIC, MAX_MESSAGES, channel_image, image_bytes, tagged
    from mtm_onboard.firmware.seal import SEAL_MAGIC
    from mtm_onboard.protocol import load_key
    from mtm_onboard.protocol.atomicfile import replacing
    from mtm_onboard.protocol.framing import channel_symbols
    from mtm_onboard.protocol.output_file import check_outputs
    from mtm_onboard.runtime.message import message_of

    if args.device_key is None and any(
        value is not None for value in (args.device_channel, args.counter, args.noise_limit)
    ):
        args.usage_error("a seal needs --device-key")
    _check_span(args.span)
    check_outputs("mtm-onboard export", args.out, force=args.force, begins=(IMAGE_MAGIC, SEAL_MAGIC))
    key = load_key(args.key)
    scheme = key.scheme
    channel = _channel(scheme, args.channel)
    message, messages = message_of(content(args), key), _messages(args, scheme)
    # More messages than an image holds are refused below.
    first = _first_message(args, key)
    last = first + min(messages, MAX_MESSAGES)
    slots = range(first, last) if scheme.schedule == "rolling" else range(1)
    own = [channel_symbols(message.symbols(slot), scheme)[channel.name] for slot in slots]
    image = channel_image(
        key.codebook(),
        channel.name,
        [symbol for symbols in own for symbol in symbols],
        limits=(args.limit_mps, args.limit_mps, args.limit_radps),
        repeat=not args.no_repeat,
        first_message=first,
        messages=messages,
    )
    # The tag is of format 1, whose secret whoever provisions has; files of format 2 leave it empty.
    image = tagged(image, key.secret) if isinstance(key.secret, bytes) else image
    data = image_bytes(image) if args.device_key is None else _sealed(args, scheme, channel, image)
    with replacing(args.out, mode=0o600) as temporary:
        temporary.write_bytes(data)
    seconds = image.samples.shape[1] / scheme.rate_hz
    ending = "again and again" if image.repeats else "once"
    since = f" from slot {first} on" if scheme.schedule == "rolling" else ""
    print(
        f"wrote {args.out}: {len(data)} bytes, channel {channel.name}, {image.messages} message(s) in {seconds:g} s"
        f"{since}, {ending}, {scheme.rate_hz:g} Hz, scheme {scheme.fingerprint}"
    )
    return 0


def _sealed(args: argparse.Namespace, scheme: "Scheme", channel: "Channel", image: "Image") -> bytes:
    import time

    from mtm_onboard.firmware.device_key import load_device_key
    from mtm_onboard.firmware.seal import seal_of, sealed
    from mtm_onboard.model.velocity import AXES

    number = scheme.channels.index(channel) if args.device_channel is None else args.device_channel
    counter = int(time.time()) if args.counter is None else args.counter
    most = _NOISE_SIGMAS if args.noise_limit is None else args.noise_limit
    sigmas = dict(zip(channel.axes, channel.sigmas, strict=True))
    limits = [most * sigmas.get(axis, 0.0) for axis in AXES]
    return sealed(image, seal_of(number, counter, limits), load_device_key(args.device_key))


def _first_message(args: argparse.Namespace, key: "Key") -> int:
    """The slot of the first message: as asked, else the next that begins, where a key's waveforms follow the day."""
    from time import time

    from mtm_onboard.protocol.slots import next_slot

    if args.first_message is not None:
        return int(args.first_message)
    return 0 if key.scheme.schedule == "fixed" or key.holding.grant is None else next_slot(time(), key.scheme)


def _channel(scheme: "Scheme", name: str | None) -> "Channel":
    from mtm_onboard.protocol import MtmError

    if name is not None:
        return scheme.channel(name)
    if len(scheme.channels) > 1:
        names = ", ".join(channel.name for channel in scheme.channels)
        raise MtmError(f"the scheme has several channels; say with --channel which the robot plays: {names}")
    return scheme.channels[0]


def _messages(args: argparse.Namespace, scheme: "Scheme") -> int:
    from mtm_onboard.protocol.errors import WrongValueError

    if args.span is None:
        return 1 if args.messages is None else int(args.messages)
    messages: float = args.span * scheme.rate_hz / scheme.message_ticks
    if not math.isfinite(messages):
        raise WrongValueError(f"the span is {args.span} s; give a shorter one")
    return math.ceil(messages)


def _check_span(span: float | None) -> None:
    from mtm_onboard.protocol.errors import WrongValueError

    if span is not None and not (math.isfinite(span) and span > 0):
        raise WrongValueError(f"the span is {span} s; give a number above zero")
