"""Several recordings of one message, each with a view and a clock of its own, decoded together."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.special import softmax

from mtm_audit.decoding.decode import decoded_once, heard_of, symbols_of_frame
from mtm_audit.decoding.decoding import Decoding
from mtm_audit.decoding.frames import Heard, decode_frames
from mtm_audit.decoding.leaps import without_leaps
from mtm_audit.decoding.pieces import pieces_of
from mtm_audit.decoding.readings import Progress, Readings, part_of
from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.decoding.verdict import is_present, judged
from mtm_audit.detectors.base import ChannelReading
from mtm_audit.model.track import Floats, Track
from mtm_audit.significance.evidence import Evidence
from mtm_audit.significance.joint import Witness, weigh_together
from mtm_audit.significance.message_evidence import MessageEvidence
from mtm_audit.significance.weighed_channel import weighed
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.key import Key
from mtm_onboard.protocol.scheme import Scheme

_LEAST = 1e-300


@dataclass(frozen=True)
class Recorded:
    """The tracks of one recording, and how to decode it; `settings.at` is of this recording."""

    tracks: tuple[Track, ...]
    settings: DecodeSettings


@dataclass(frozen=True)
class _Read:
    """One recording's decoding and readings; its windows are `ahead` of those of the first, counted alike in all."""

    decoding: Decoding
    readings: Readings
    message: MessageEvidence
    ahead: int = 0


def decode_together(recordings: Sequence[Recorded], key: Key, progress: Progress | None = None) -> tuple[Decoding, int]:
    """What recordings of one message say together, and the number of the one that shows most, whose channels it has.

    Raises MtmError when a recording cannot be read, or is so long that it would be read in pieces.
    """
    scheme = key.scheme
    read = [
        _read(recorded, key, part_of(progress, "recording", number, len(recordings)))
        for number, recorded in enumerate(recordings)
    ]
    first = max(read, key=lambda each: (each.decoding.order_known, each.message.presence_nats))
    aligned = [_aligned(each, first, scheme) for each in read]
    positions = range(scheme.message_symbols if scheme.framing is None else 0)
    message = weigh_together([_turned(each, scheme) for each in aligned], _witnesses(aligned, scheme), positions)
    base = first.decoding
    channels = tuple(
        replace(channel, nats=message.channels_nats.get(channel.channel.name, channel.nats))
        for channel in base.channels
    )
    posteriors = _posteriors(aligned, scheme)
    symbols = tuple(None if item is None else item.symbol for item in message.symbols)
    together = replace(
        base,
        evidence=Evidence(message.presence_nats, None),
        posteriors=posteriors,
        symbols=symbols or base.symbols,
        symbol_nats=tuple(None if item is None else item.nats for item in message.symbols) or base.symbol_nats,
        channels=channels,
        frames=(),
        together=tuple(each.decoding for each in read),
    )
    if scheme.framing is not None and is_present(together.evidence, base.settings.threshold):
        frames = decode_frames(
            _heard(aligned, first, scheme), scheme, key.secret, base.start.first_slot, order_known=base.order_known
        )
        posteriors, symbols = symbols_of_frame(frames[-1])
        together = replace(together, frames=frames, posteriors=posteriors, symbols=symbols)
    return judged(together, base.settings.threshold), read.index(first)


def _read(recorded: Recorded, key: Key, progress: Progress | None) -> _Read:
    mended = [without_leaps(track) for track in recorded.tracks]
    tracks = [item.track for item in mended]
    if pieces_of(tracks, key.scheme, recorded.settings.onset_s):
        raise MtmError(
            "a recording of more than ten minutes is read in pieces and not with others; cut out the message"
        )
    decoding, readings = decoded_once(tracks, key, recorded.settings, progress)
    if readings.message is None:
        raise MtmError("only exact evidence can be added up; leave --detector out")
    leaps = {item.track.name: item.leaps for item in mended if item.leaps}
    return _Read(replace(decoding, leaps=leaps), readings, readings.message)


def _aligned(each: _Read, first: _Read, scheme: Scheme) -> _Read:
    """The reading with its windows counted as the first one's.

    Under the rolling schedule windows have numbers. Under the fixed one a search leaves open which window is the first
    of the message; the turn is taken under which both say most, for which each recording's onset pays.
    """
    counts = {channel.symbols for channel in scheme.channels}
    if scheme.schedule == "rolling":
        slots = each.decoding.start.first_slot - first.decoding.start.first_slot
        return replace(each, ahead=slots)
    if each is first or each.decoding.start.onset is not None or len(counts) > 1:
        return each
    turns = range(counts.pop())
    return replace(each, ahead=max(turns, key=lambda turn: _agreement(each, first, turn)))


def _agreement(each: _Read, first: _Read, turn: int) -> float:
    own, other = each.readings.channels, first.readings.channels
    return sum(
        float(np.max(other[name].reading.scores + np.roll(own[name].reading.scores, turn, axis=0), axis=1).sum())
        for name in own
        if name in other
    )


def _turn(each: _Read, scheme: Scheme) -> int:
    """By how many positions the message of a recording begins later than that of the first."""
    return each.ahead if scheme.schedule == "fixed" else 0


def _turned(each: _Read, scheme: Scheme) -> MessageEvidence:
    """The recording's own evidence with its symbols in the first one's order."""
    turn = _turn(each, scheme)
    if not turn or not each.message.symbols:
        return each.message
    symbols = list(each.message.symbols)
    for channel in scheme.channels:
        first = scheme.first_position(channel)
        place = slice(first, first + channel.symbols)
        own = list(each.message.symbols[place])
        symbols[place] = own[-turn:] + own[:-turn]
    return replace(each.message, symbols=tuple(symbols))


def _witnesses(aligned: Sequence[_Read], scheme: Scheme) -> dict[str, list[Witness]]:
    found: dict[str, list[Witness]] = {}
    for each in aligned:
        turn = _turn(each, scheme)
        for part in each.readings.weighed:
            terms = part.terms
            channel = next(item for item in scheme.channels if item.name == terms.name)
            numbers = np.zeros_like(terms.positions)
            positions = terms.positions
            if not terms.shared:
                numbers = terms.span.numbers[terms.groups] + each.ahead * channel.symbols
                # Of a recording of several framed messages every window is a position.
                positions = numbers if scheme.framing is not None else positions
            elif turn:
                begin = scheme.first_position(channel)
                positions = begin + (positions - begin + turn) % channel.symbols
            witness = Witness(item=weighed(terms, part.cost), axes=part.axes, positions=positions, waveforms=numbers)
            found.setdefault(terms.name, []).append(witness)
    return found


def _posteriors(aligned: Sequence[_Read], scheme: Scheme) -> Floats:
    """Probabilities (L, M) of all recordings together."""
    total: Floats = np.zeros((scheme.message_symbols, scheme.alphabet_size))
    for each in aligned:
        logs = np.log(np.maximum(each.decoding.posteriors, _LEAST))
        turn = _turn(each, scheme)
        if turn:
            for channel in scheme.channels:
                first = scheme.first_position(channel)
                place = slice(first, first + channel.symbols)
                logs[place] = np.roll(logs[place], turn, axis=0)
        total += logs
    return np.asarray(softmax(total, axis=1))


def _heard(aligned: Sequence[_Read], first: _Read, scheme: Scheme) -> list[Heard]:
    """All recordings' windows, numbered and timed as the first one's."""
    heard = list(heard_of(first.readings, scheme))
    for each in aligned:
        if each.readings is not first.readings:
            heard += [
                replace(item, result=_moved(item, each, first, scheme)) for item in heard_of(each.readings, scheme)
            ]
    return heard


def _moved(item: Heard, each: _Read, first: _Read, scheme: Scheme) -> ChannelReading:
    reading, timing = item.result.reading, item.result.reading.timing
    if scheme.schedule == "rolling":
        at, own = first.decoding.settings.at, each.decoding.settings.at
        later_s = 0.0 if at is None or own is None else own.unix_s - at.unix_s
        ahead = each.ahead * item.channel.symbols
        timing = replace(timing, onset_s=timing.onset_s + later_s)
        reading = replace(reading, window_starts_s=reading.window_starts_s + later_s)
    else:
        # Clocks that know nothing of each other: only which position a window carries is common.
        ahead, known = each.ahead, first.readings.channels.get(item.channel.name)
        timing = timing if known is None else replace(timing, onset_s=known.reading.timing.onset_s)
    moved = replace(reading, window_numbers=reading.window_numbers + ahead, timing=timing)
    return replace(item.result, reading=moved)
