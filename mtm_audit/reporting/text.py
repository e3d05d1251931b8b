"""The decode as a person reads it: verdict first, then what it rests on."""

import math
from collections.abc import Sequence

import numpy as np
from rich.console import Console, Group, RenderableType
from rich.table import Table
from rich.text import Text

from mtm_audit.decoding.decoding import ChannelDecoding, Decoding
from mtm_audit.model.recording import Recording
from mtm_audit.reporting.basis import Basis
from mtm_audit.reporting.delivery import clock_sentence, frame_sentences, payload_text
from mtm_onboard.protocol.framing import payload_bits

_NO_BASIS = Basis()
_COLOURS = {"decoded": "bold green", "absent": "bold red", "inconclusive": "bold yellow"}


def print_report(
    console: Console, recording: Recording, decoding: Decoding, warnings: Sequence[str], basis: Basis = _NO_BASIS
) -> None:
    """Print verdict, what it rests on, evidence, channels and warnings."""
    console.print(_report(recording, decoding, warnings, basis), highlight=False)


def verdict_sentence(decoding: Decoding) -> str:
    """The verdict in one line."""
    if decoding.verdict == "decoded" and decoding.message is not None:
        bits = message_bits(decoding)
        return f"decoded: {payload_text(decoding.message)}" + (f" ({bits})" if bits else "")
    if decoding.verdict == "absent":
        return f"absent: no message of key {decoding.key_id} was found in this recording"
    return "inconclusive: a message of this key is there, but not all of it could be read"


def message_bits(decoding: Decoding) -> str | None:
    """The message as a binary number with all its digits, `0b...`; None unless decoded, and a number."""
    framing, message = decoding.scheme.framing, decoding.message
    if not isinstance(message, int):
        return None
    return f"0b{message:0{framing.payload_bits if framing else payload_bits(decoding.scheme)}b}"


def chance_sentence(decoding: Decoding) -> str:
    """How often the verdict can be wrong, in one line."""
    evidence, threshold = decoding.evidence, decoding.settings.threshold
    if evidence.nats is None:
        return _decoy_sentence(decoding)
    if decoding.verdict == "decoded":
        odds = f"{1.0 / threshold:,.0f}"
        return f"Wrong at most once in {odds}, for any robot, camera and interference; keys drawn at random."
    found = (
        "no more than any recording" if evidence.p_value >= 1.0 else f"as much as at most {rarity(evidence.p_value)}"
    )
    return f"It shows {found} without a message of this key; the limit is {rarity(threshold)}."


def _decoy_sentence(decoding: Decoding) -> str:
    """The p-value in words, and what it is estimated from."""
    evidence = decoding.evidence
    decoys = 0 if evidence.decoys is None else len(evidence.decoys.decoy_strengths)
    basis = f"judged by {decoys} decoy keys"
    if evidence.p_value < 1.0 / decoys:
        basis = f"extrapolated from {decoys} decoy keys"
    return (
        f"About {rarity(evidence.p_value)} recordings without a message of this key would look like this, {basis}; "
        f"the limit is {rarity(decoding.settings.threshold)}."
    )


def evidence_sentence(decoding: Decoding) -> str:
    """The evidence in bits, and what that means."""
    evidence = decoding.evidence
    if evidence.nats is None:
        return f"{evidence.bits:.1f} bits of evidence for a message of this key (-log2 p)"
    needed = math.log2(1.0 / decoding.settings.threshold)
    return f"{evidence.bits:.1f} bits for a message of this key, {needed:.1f} are needed"


def decoys_sentence(decoding: Decoding) -> str | None:
    """What decoys say beside exact evidence; None when none were asked for."""
    evidence = decoding.evidence
    if evidence.nats is None or evidence.decoys is None:
        return None
    strengths = evidence.decoys.decoy_strengths
    return (
        f"strength {_score(evidence.decoys.strength)} beside {_score(float(np.mean(strengths)))} ± "
        f"{_score(float(np.std(strengths, ddof=1)))} of {len(strengths)} decoy keys, about "
        f"{rarity(evidence.decoys.p_value)}"
    )


def search_sentence(recording: Recording, decoding: Decoding) -> str | None:
    """Which tracks were matched by search; None when all were named. Without a message the pairs are chance."""
    found = {item.channel.body: item.glimpse.name for item in decoding.channels if item.searched and item.glimpse}
    if not found:
        return None
    among = f"among {len(recording.tracks)} tracks, which is paid for"
    if decoding.verdict == "absent":
        return f"Which track shows {', '.join(found)} was searched {among}; without a message the pairs are chance."
    pairs = ", ".join(f"{body} is {track}" for body, track in found.items())
    return f"Tracks matched by search {among}: {pairs}."


def frame_sentence(recording: Recording, decoding: Decoding) -> str | None:
    """Along whose axes a message was read; None for the world's, and where nothing was read."""
    if decoding.verdict == "absent" or decoding.frame == "world":
        return None
    headings = "as their paths show them" if decoding.frame == "path" else f"as recorded{_axes_ahead(recording)}"
    return f"Read along the robots' own axes, by headings {headings}; trying that is paid for."


def _axes_ahead(recording: Recording) -> str:
    """Which axes of bodies the headings are of, in brackets; empty where the recording has headings as such."""
    ahead: dict[str, list[str]] = {}
    for track in recording.tracks:
        if track.heading_axis is not None:
            ahead.setdefault(track.heading_axis, []).append(track.name)
    said = ", ".join(f"the {axis} axis of {', '.join(names)}" for axis, names in ahead.items())
    return f" ({said})" if said else ""


def piece_sentence(decoding: Decoding) -> str | None:
    """Which piece of a long recording shows the message; None for a recording that was read as a whole."""
    if decoding.piece is None:
        return None
    if decoding.verdict == "absent":
        return "The recording was read in pieces, since it is long; none of them shows a message."
    begin_s, end_s = decoding.piece
    return f"Read in pieces, since the recording is long; this is what {begin_s:.0f} s to {end_s:.0f} s show."


def together_sentence(recording: Recording, decoding: Decoding) -> str | None:
    """What each of several recordings says by itself; None for a single one."""
    if not decoding.together:
        return None
    said = ", ".join(
        f"{name} {each.evidence.bits:.1f} bits"
        for name, each in zip(recording.together, decoding.together, strict=True)
    )
    return f"Recordings read together, by themselves: {said}. The channels are those of {recording.paths[0]}."


def rarity(probability: float) -> str:
    """A probability as "43 in 100", "1 in 2,500" or "1 in 3e14"."""
    if probability >= 0.01:
        return f"{100.0 * probability:.0f} in 100"
    if probability <= 0.0:
        return "0 in 100"
    odds = 1.0 / probability
    return f"1 in {odds:,.0f}" if odds < 1e7 else f"1 in {odds:.0e}".replace("e+", "e")


def rests_on(recording: Recording, decoding: Decoding, basis: Basis = _NO_BASIS) -> tuple[str, ...]:
    """What the verdict rests on beside its evidence, a sentence each."""
    said = (
        *basis.sentences,
        clock_sentence(decoding),
        search_sentence(recording, decoding),
        frame_sentence(recording, decoding),
        piece_sentence(decoding),
        together_sentence(recording, decoding),
    )
    return tuple(sentence for sentence in said if sentence)


def facts(recording: Recording, decoding: Decoding) -> tuple[tuple[str, str], ...]:
    """Key, scheme, recording and evidence, each with its name."""
    scheme = decoding.scheme
    found = (
        ("key", decoding.key_id),
        ("scheme", f"{scheme.name} (fingerprint {scheme.fingerprint})"),
        ("recording", recording_line(recording)),
        ("evidence", evidence_sentence(decoding)),
        ("decoys", decoys_sentence(decoding)),
        ("frame", _frame_line(decoding)),
    )
    return tuple((name, line) for name, line in found if line)


def _report(recording: Recording, decoding: Decoding, warnings: Sequence[str], basis: Basis) -> RenderableType:
    said = frame_sentences(decoding, authenticates=basis.authenticates) + rests_on(recording, decoding, basis)
    parts: list[RenderableType] = [
        Text(verdict_sentence(decoding), style=_COLOURS[decoding.verdict]),
        Text(chance_sentence(decoding)),
        *map(Text, said),
        Text(""),
        *(Text(f"{name:<11}{line}") for name, line in facts(recording, decoding)),
        Text(""),
        table_of(decoding),
    ]
    parts += [Text(f"warning: {warning}", style="yellow") for warning in warnings]
    return Group(*parts)


def recording_line(recording: Recording) -> str:
    """Kind, length and bodies of the recording in one line."""
    rate_hz = recording.frame_rate_hz
    rate = "" if rate_hz is None else f" at {rate_hz:.4g} a second"
    what = "frames" if recording.kind == "video" else "samples"
    names = ", ".join(track.name for track in recording.tracks)
    speed = "" if recording.speed == 1.0 else f", played {recording.speed:.4g} times as fast as its times say"
    return f"{recording.kind}, {recording.duration_s:.1f} s, {recording.frames} {what}{rate}{speed}, tracks: {names}"


def table_of(decoding: Decoding) -> Table:
    """The channels with what was read; without a message without symbols."""
    if decoding.verdict == "absent":
        return _absent_table(decoding)
    return _symbol_table(decoding) if decoding.scheme.framing is None else _frame_table(decoding)


def _frame_table(decoding: Decoding) -> Table:
    """Channels with their windows; a frame's symbols may be dealt over all of them."""
    table = _table("channel", "track", "start s", "rate Hz", "windows", "margin")
    for channel in decoding.channels:
        reading, head = channel.reading, [channel.channel.name, _track_name(channel)]
        if reading is None:
            table.add_row(*head, "-", "-", "0", "-")
            continue
        ranked = np.sort(reading.window_scores, axis=1)
        margin = float(np.median(ranked[:, -1] - ranked[:, -2]))
        starts = [f"{channel.onset_s:.2f}", f"{reading.timing.rate_hz:.2f}"]
        table.add_row(*head, *starts, str(len(ranked)), _score(margin))
    return table


def _frame_line(decoding: Decoding) -> str | None:
    """How many of a frame's symbols were seen, and are sure; None without a frame."""
    if not decoding.frames:
        return None
    count, unseen = len(decoding.symbols), sum(symbol is None for symbol in decoding.symbols)
    return f"{count - len(decoding.uncertain)} of {count} symbols are sure, {unseen} were not seen"


def _symbol_table(decoding: Decoding) -> Table:
    exact = decoding.evidence.nats is not None
    sure = ("bits", "needed") if exact else ("sure",)
    table = _table("channel", "track", "start s", "rate Hz", "windows", "symbol", *sure, "best", "next", "margin")
    for channel in decoding.channels:
        first = decoding.scheme.first_position(channel.channel)
        reading, head = channel.reading, [channel.channel.name, _track_name(channel)]
        if reading is None:
            table.add_row(*head, "-", "-", "0", channel.state, *["-"] * (len(sure) + 3))
            continue
        head += [f"{channel.onset_s:.2f}", f"{reading.timing.rate_hz:.2f}"]
        for position in range(channel.channel.symbols):
            windows = int(np.sum(reading.window_positions == position))
            place = first + position
            doubt = " ?" if place in decoding.uncertain else ""
            best, runner_up = (float(score) for score in np.sort(reading.scores[position])[:-3:-1])
            table.add_row(
                *(head if position == 0 else [""] * len(head)),
                str(windows), f"{decoding.symbols[place]}{doubt}", *_sureness(decoding, place),
                _score(best), _score(runner_up), _score(best - runner_up),
            )  # fmt: skip
    return table


def _sureness(decoding: Decoding, place: int) -> tuple[str, ...]:
    """A symbol's bits and the bits it needs, or its posterior where there is no exact evidence."""
    symbol, nats = decoding.symbols[place], decoding.symbol_nats[place]
    if decoding.evidence.nats is None:
        return (percent(0.0 if symbol is None else float(decoding.posteriors[place, symbol])),)
    found = "-" if nats is None else f"{nats / math.log(2.0):.1f}"
    return found, f"{decoding.needed_nats / math.log(2.0):.1f}"


def _absent_table(decoding: Decoding) -> Table:
    """Without symbols: those of a recording without a message would be chance, and would look like one."""
    evidence, decoys = decoding.evidence, decoding.evidence.decoys
    if evidence.nats is not None or decoys is None:
        table = _table("channel", "track", "windows", "seen")
        for channel in decoding.channels:
            windows = 0 if channel.reading is None else len(channel.reading.window_positions)
            seen = "yes" if channel.reading is not None else channel.state
            table.add_row(channel.channel.name, _track_name(channel), str(windows), seen)
        return table
    table = _table("channel", "track", "windows", "this key", "decoy keys")
    for channel in decoding.channels:
        windows = 0 if channel.reading is None else len(channel.reading.window_positions)
        strength = "-" if channel.reading is None else _score(channel.reading.strength)
        table.add_row(channel.channel.name, _track_name(channel), str(windows), strength, "")
    mean, spread = float(np.mean(decoys.decoy_strengths)), float(np.std(decoys.decoy_strengths, ddof=1))
    table.add_section()
    table.add_row("together", "", "", _score(decoys.strength), f"{_score(mean)} ± {_score(spread)}")
    return table


def percent(probability: float) -> str:
    """A posterior for reading: never rounded up to certainty."""
    return "> 99.9 %" if probability > 0.999 else f"{100.0 * probability:.1f} %"


def _score(score: float) -> str:
    """Coherencies lie below one, log-likelihood ratios in the hundreds."""
    return f"{score:.3f}" if abs(score) < 10.0 else f"{score:.1f}"


def _track_name(channel: ChannelDecoding) -> str:
    return "-" if channel.glimpse is None else channel.glimpse.name


def _table(*columns: str) -> Table:
    table = Table(box=None, padding=(0, 1, 0, 0), pad_edge=False, header_style="bold")
    for number, column in enumerate(columns):
        table.add_column(column, justify="left" if number < 2 else "right", no_wrap=True)
    return table
