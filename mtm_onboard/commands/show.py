"""`mtm-onboard show`: the scheme of a key file, never its secret."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mtm_onboard.protocol import Key, Scheme


def add_parser(subparsers: "argparse._SubParsersAction[argparse.ArgumentParser]") -> None:
    """Add the command and its options."""
    parser = subparsers.add_parser("show", help="print a key's scheme and fingerprint, not its secret")
    parser.add_argument("--key", required=True, type=Path, metavar="FILE", help="the key file")
    parser.set_defaults(handler=_show)


def _show(args: argparse.Namespace) -> int:
    from mtm_onboard.protocol import load_key

    print("\n".join(_lines(load_key(args.key))))
    return 0


def _lines(key: "Key") -> list[str]:
    from mtm_onboard.protocol.scheme import count_bins

    scheme = key.scheme
    low_hz, high_hz = scheme.band_hz
    duration_s = scheme.message_ticks / scheme.rate_hz
    lines = [
        f"key           {key.id}",
        *_grant_lines(key),
        f"scheme        {scheme.name} (version {scheme.version}, epoch {scheme.epoch})",
        f"fingerprint   {scheme.fingerprint}",
        f"rate          {scheme.rate_hz:g} Hz",
        f"band          {low_hz:g} to {high_hz:g} Hz",
        f"spectrum      {_spectrum_text(scheme)}",
        f"alphabet      {scheme.alphabet_size} symbols",
        f"message       {scheme.message_ticks} ticks, {duration_s:g} s, {scheme.message_symbols} symbols",
        *_frame_lines(scheme),
        f"played as     combine {scheme.combine}, pooling {scheme.pooling}, power {scheme.power}, "
        f"schedule {scheme.schedule}",
    ]
    for channel in scheme.channels:
        ticks = scheme.window_ticks(channel)
        lines.append(
            f"channel       {channel.name}: body {channel.body}, axes {','.join(channel.axes)}, "
            f"{channel.symbols} symbols of {ticks} ticks ({count_bins(ticks, scheme.rate_hz, scheme.band_hz)} tones), "
            f"sigma {channel.sigma_text}"
        )
    return lines


def _spectrum_text(scheme: "Scheme") -> str:
    """Levels beside the loudest."""
    if scheme.spectrum is None:
        return "flat"
    top_db = max(level_db for _, level_db in scheme.spectrum)
    return ", ".join(f"{level_db - top_db:.3g} dB at {hz:g} Hz" for hz, level_db in scheme.spectrum)


def _grant_lines(key: "Key") -> list[str]:
    """What the file can do, and until when."""
    grant = key.holding.grant
    if grant is None:
        return ["can do        format 1: read and play every channel on every day"]
    channels = ", ".join(grant.channels)
    can = {
        "master": "issue every file, disclose days, and read and play every channel",
        "robot": f"play {channels}, and make the fleet's tags",
        "auditor": f"read {channels}, and so play them as well",
        "disclosed": f"show anybody what {channels} said",
        "public": f"read and play the public channel of {channels}",
    }[grant.kind]
    lines = [f"file          {grant.kind}, serial {grant.serial}", f"can do        {can}"]
    days = (grant.last_day - grant.first_day).days + 1
    lines.append(f"days          {grant.first_day} to {grant.last_day} in UTC ({days})")
    if grant.not_after is not None:
        from datetime import UTC

        lines.append(f"not after     {grant.not_after.astimezone(UTC):%Y-%m-%d %H:%M:%S} UTC")
    return lines


def _frame_lines(scheme: "Scheme") -> list[str]:
    from mtm_onboard.protocol.framing import payload_bits

    framing = scheme.framing
    bits = payload_bits(scheme) if framing is None else framing.payload_bits
    rate_bps = bits * scheme.rate_hz / scheme.message_ticks
    if framing is None:
        return [f"payload       a plain number of {bits} bits, without check or code: {rate_bps:.3g} bits/s"]
    kind = f"a number of {bits} bits" if framing.payload == "integer" else f"up to {bits // 8} bytes"
    kind += " of text" if framing.payload == "text" else ""
    check = {"none": "no check", "crc": f"CRC of {framing.check_bits} bits", "tag": f"tag of {framing.check_bits} bits"}
    counted = f"message number modulo {1 << framing.number_bits}" if framing.number_bits else "no message number"
    return [
        f"payload       {kind}: {bits} bits, {rate_bps:.3g} bits/s",
        f"frame         {counted}, {check[framing.check]}, {_code_words(scheme)}, "
        f"{'interleaved' if framing.interleave else 'not interleaved'}",
    ]


def _code_words(scheme: "Scheme") -> str:
    from mtm_onboard.protocol.framing.framing import layout_of

    assert scheme.framing is not None
    if scheme.framing.code == "none":
        return "no code"
    layout = layout_of(scheme.framing, scheme.alphabet_size, scheme.message_symbols)
    return (
        f"Reed-Solomon over GF(2^{layout.field_bits}), {layout.parity} of {layout.code_symbols} code symbols parity "
        f"(corrects {layout.parity // 2} wrong or {layout.parity} missing ones)"
    )
