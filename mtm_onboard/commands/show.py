"""`mtm-onboard show`: the scheme of a key file, never its secret."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mtm_onboard.protocol import Key


def add_parser(subparsers: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command and its options."""
    parser = subparsers.add_parser("show", help="print a key's scheme and fingerprint, not its secret")
    parser.add_argument("--key", required=True, type=Path, help="the key file")
    parser.set_defaults(handler=_show)


def _show(args: argparse.Namespace) -> int:
    from mtm_onboard.protocol import load_key

    print("\n".join(_lines(load_key(args.key))))
    return 0


def _lines(key: "Key") -> list[str]:
    from mtm_onboard.protocol.framing import payload_bits
    from mtm_onboard.protocol.scheme import count_bins

    scheme = key.scheme
    low_hz, high_hz = scheme.band_hz
    duration_s = scheme.message_ticks / scheme.rate_hz
    lines = [
        f"key           {key.id}",
        f"scheme        {scheme.name} (version {scheme.version}, epoch {scheme.epoch})",
        f"fingerprint   {scheme.fingerprint}",
        f"rate          {scheme.rate_hz:g} Hz",
        f"band          {low_hz:g} to {high_hz:g} Hz",
        f"alphabet      {scheme.alphabet_size} symbols",
        f"message       {scheme.message_ticks} ticks, {duration_s:g} s, {scheme.message_symbols} symbols, "
        f"{payload_bits(scheme)} bits",
        f"played as     combine {scheme.combine}, pooling {scheme.pooling}, power {scheme.power}, "
        f"schedule {scheme.schedule}",
    ]
    for channel in scheme.channels:
        ticks = scheme.window_ticks(channel)
        lines.append(
            f"channel       {channel.name}: body {channel.body}, axes {','.join(channel.axes)}, "
            f"{channel.symbols} symbols of {ticks} ticks ({count_bins(ticks, scheme.rate_hz, scheme.band_hz)} tones), "
            f"sigma {channel.sigma:g}"
        )
    return lines
