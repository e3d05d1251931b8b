"""A decode told stage by stage, and at which stage it failed and why."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mtm_audit.decoding.decoding import ChannelDecoding, Decoding
from mtm_audit.model.recording import Recording
from mtm_audit.model.track import Track
from mtm_audit.reporting.delivery import frame_sentences
from mtm_audit.reporting.text import (
    chance_sentence,
    decoys_sentence,
    evidence_sentence,
    percent,
    recording_line,
    verdict_sentence,
)
from mtm_onboard.protocol.framing import payload_bits

_TRY = {
    "symbols": "record longer or from closer; repeats of the message add up",
    "message": "give --onset when it is known, and check what the robot was told to send",
    "verdict": "check that the key is the robot's, that it was sending (its journal says), and record longer",
}


@dataclass(frozen=True)
class Stage:
    """What one stage found, in short lines; `failed` when the decode came no further than this.

    `says_what_to_do` when the lines are a refusal, which says so itself.
    """

    name: str
    lines: tuple[str, ...]
    failed: bool = False
    says_what_to_do: bool = False


def text_of_stages(stages: Sequence[Stage]) -> str:
    """The stages as lines of text, each with its name in front; a failed one says what to try."""
    lines = []
    for stage in stages:
        said = list(stage.lines)
        if stage.failed:
            said[0] = f"FAILED: {said[0]}"
            if not stage.says_what_to_do:
                said.append(f"try: {_TRY[stage.name]}")
        lines += [f"{stage.name if row == 0 else '':<11}{line}" for row, line in enumerate(said)]
    return "\n".join(lines) + "\n"


def stages_of_recording(recording: Recording) -> list[Stage]:
    """Recording and tracks."""
    tracks = tuple(
        f"{track.name}: seen in {int(track.valid.sum())} of {len(track.times_s)} {_observations(recording)}, positions "
        f"in {track.unit}{_heading_of(track)}"
        for track in recording.tracks
    )
    return [Stage("recording", (recording_line(recording), *recording.warnings)), Stage("tracks", tracks)]


def stages_of_decoding(decoding: Decoding) -> list[Stage]:
    """Glimpse to verdict; the stage that kept the message from being read is marked as failed."""
    weak = decoding.verdict == "absent"
    unclear = decoding.verdict == "inconclusive"
    unreadable = unclear and (not decoding.uncertain or decoding.scheme.framing is not None)
    stages = [
        Stage("glimpse", tuple(_glimpse_line(channel) for channel in decoding.channels)),
        Stage("timing", tuple(_timing_line(channel, decoding) for channel in decoding.channels)),
        Stage("detector", _detector_lines(decoding)),
    ]
    if weak:
        return [*stages, Stage("verdict", (verdict_sentence(decoding), chance_sentence(decoding)), failed=True)]
    stages += [
        Stage("symbols", _symbol_lines(decoding), failed=unclear and not unreadable),
        Stage("message", (_message_line(decoding),), failed=unreadable),
        Stage("verdict", (verdict_sentence(decoding), chance_sentence(decoding))),
    ]
    return stages


def _heading_of(track: Track) -> str:
    return "" if track.heading_axis is None else f", heading of its {track.heading_axis} axis"


def _observations(recording: Recording) -> str:
    return "frames" if recording.kind == "video" else "samples"


def _glimpse_line(channel: ChannelDecoding) -> str:
    glimpse = channel.glimpse
    if glimpse is None:
        return f"{channel.channel.name}: no track shows {channel.channel.body}"
    gaps, durations_s = int(np.sum(~glimpse.valid)), glimpse.durations_s
    missed_s = float(durations_s[~glimpse.valid].sum())
    found = ", found by search" if channel.searched else ""
    return (
        f"{channel.channel.name} from track {glimpse.name}{found}: {len(durations_s)} intervals of "
        f"{1000.0 * float(np.median(durations_s)):.1f} ms, {gaps} gaps, {missed_s:.2f} s"
    )


def _timing_line(channel: ChannelDecoding, decoding: Decoding) -> str:
    reading = channel.reading
    if reading is None:
        return f"{channel.channel.name}: not read"
    how = "given" if decoding.settings.onset_s is not None else "found"
    if decoding.verdict == "absent":
        # Without a message the likeliest start is that of chance.
        given = f"{channel.onset_s:.3f} s is looked at, as given" if how == "given" else "no start was found"
        return f"{channel.channel.name}: {given}"
    return (
        f"{channel.channel.name}: the message begins at {channel.onset_s:.3f} s ({how}), ticks at "
        f"{reading.timing.rate_hz:.2f} Hz"
    )


def _detector_lines(decoding: Decoding) -> tuple[str, ...]:
    lines = []
    for channel in decoding.channels:
        if channel.reading is not None:
            ranked = np.sort(channel.reading.scores, axis=1)
            windows = len(channel.reading.window_positions)
            line = f"{channel.channel.name}: {windows} windows"
            if decoding.verdict != "absent":
                # Without a message the best symbol is that of chance, and its lead would look like a message.
                margin = float(np.mean(ranked[:, -1] - ranked[:, -2]))
                line += f", best score {float(ranked[:, -1].mean()):.3f}, {margin:.3f} ahead of the next"
            lines.append(line)
    lines.append(f"{decoding.settings.detector}: {evidence_sentence(decoding)}")
    lines += [line for line in [decoys_sentence(decoding)] if line]
    return tuple(lines)


def _symbol_lines(decoding: Decoding) -> tuple[str, ...]:
    said = [
        "?" if symbol is None else f"{symbol} ({_sure(decoding, place)})"
        for place, symbol in enumerate(decoding.symbols)
    ]
    doubt = decoding.uncertain
    state = f"{len(doubt)} of {len(said)} are not certain" if doubt else f"all of {len(said)} are certain"
    return (f"{state}: {', '.join(said)}",) if doubt else (", ".join(said), state)


def _sure(decoding: Decoding, place: int) -> str:
    nats, symbol = decoding.symbol_nats[place], decoding.symbols[place]
    if nats is not None:
        return f"{nats / math.log(2.0):.1f} bits"
    return percent(0.0 if symbol is None else float(decoding.posteriors[place, symbol]))


def _message_line(decoding: Decoding) -> str:
    if decoding.scheme.framing is not None:
        return "; ".join(frame_sentences(decoding)) or "the symbols are no frame of this key whose check holds"
    bits = payload_bits(decoding.scheme)
    if decoding.message is not None:
        return f"the symbols spell {decoding.message!r}, one of 0 to {(1 << bits) - 1} ({bits} bits)"
    if decoding.uncertain:
        return "not put together, since symbols are uncertain"
    if not decoding.order_known:
        return "not put together, since it repeats and nothing shows which symbol comes first"
    return f"the symbols spell no number of 0 to {(1 << bits) - 1}"
