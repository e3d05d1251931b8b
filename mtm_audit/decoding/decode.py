"""From tracks to a verdict: assignment, readings under the key, symbols or frames, message."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.special import softmax

from mtm_audit.decoding.assignment import assign_tracks
from mtm_audit.decoding.decoding import ChannelDecoding, ChannelState, Decoding
from mtm_audit.decoding.frames import Delivered, Heard, decode_frames
from mtm_audit.decoding.leaps import without_leaps
from mtm_audit.decoding.order import order_is_known
from mtm_audit.decoding.paid import paid_for, worth
from mtm_audit.decoding.pieces import Piece, pieces_of
from mtm_audit.decoding.pooling import pooled_posteriors, pooled_symbols
from mtm_audit.decoding.readings import Progress, Readings, part_of, read_tracks
from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.decoding.start import start_of
from mtm_audit.decoding.verdict import is_present, judged
from mtm_audit.detectors import make_detector
from mtm_audit.model.stage import stage
from mtm_audit.model.track import Floats, Track
from mtm_audit.significance.evidence import needed_nats
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.key import Key
from mtm_onboard.protocol.scheme import Channel, Scheme

# A recording without a message has a p-value by decoys below this once in a hundred.
NEARLY = 0.01
MORE_DECOYS = 5


def decode_tracks(
    tracks: Sequence[Track], key: Key, settings: DecodeSettings, progress: Progress | None = None
) -> Decoding:
    """Decode a message from tracks under a key, whose leaps are taken out first.

    A long recording is read in pieces (`pieces`), each of which may be the one with the message; that is paid for.
    Evidence by decoys that lies near the limit is judged anew by five times as many, since a tail known from few of
    them is taken for heavy. `progress(stage, fraction)` is called now and then. Raises MtmError when no channel can be
    read at all.
    """
    mended = [without_leaps(track) for track in tracks]
    tracks = [item.track for item in mended]
    leaps = {item.track.name: item.leaps for item in mended if item.leaps}
    with stage("timing"):
        pieces = pieces_of(tracks, key.scheme, settings.onset_s)
    if pieces:
        return replace(_best_piece(pieces, key, settings, progress), leaps=leaps)
    return replace(_judged_by_enough(tracks, key, settings, progress), leaps=leaps)


def _best_piece(pieces: Sequence[Piece], key: Key, settings: DecodeSettings, progress: Progress | None) -> Decoding:
    """The piece that shows most; framed messages of all that hold."""
    found: list[Decoding] = []
    refusal: MtmError | None = None
    for number, piece in enumerate(pieces):
        shown = part_of(progress, "piece", number, len(pieces))
        try:
            own = _judged_by_enough(piece.tracks, key, settings, shown) if piece.tracks else None
        except MtmError as error:
            refusal = refusal or error
            continue
        if own is not None:
            found.append(replace(paid_for(own, piece.count), piece=(piece.begin_s, piece.end_s)))
    if not found:
        raise refusal or MtmError("no piece of the recording shows a track for long enough; film the robots for longer")
    best = max(found, key=worth)
    frames = [frame for each in found if each.verdict == "decoded" for frame in each.frames]
    return replace(best, frames=_once(frames)) if frames else best


def _once(frames: Sequence[Delivered]) -> tuple[Delivered, ...]:
    """The frames in the order of time; those that two pieces show where they overlap once."""
    kept: list[Delivered] = []
    for frame in sorted(frames, key=lambda frame: frame.start_s):
        if not kept or frame.message.payload != kept[-1].message.payload or frame.start_s >= kept[-1].end_s:
            kept.append(frame)
        else:
            kept[-1] = replace(kept[-1], end_s=max(kept[-1].end_s, frame.end_s),
                               slots=(kept[-1].slots[0], max(kept[-1].slots[1], frame.slots[1])))  # fmt: skip
    return tuple(kept)


def _judged_by_enough(
    tracks: Sequence[Track], key: Key, settings: DecodeSettings, progress: Progress | None
) -> Decoding:
    decoding, _ = decoded_once(tracks, key, settings, progress)
    by_decoys = decoding.evidence.nats is None
    if not by_decoys or not settings.threshold < decoding.evidence.p_value <= NEARLY:
        return decoding
    more = replace(settings, decoys=MORE_DECOYS * settings.decoy_count)
    return decoded_once(tracks, key, more, progress)[0]


def decoded_once(
    tracks: Sequence[Track], key: Key, settings: DecodeSettings, progress: Progress | None
) -> tuple[Decoding, Readings]:
    """The decoding of tracks as they are, all of them in one piece, and the readings that it rests on."""
    scheme = key.scheme
    with stage("detector"):
        detector = make_detector(settings.detector, settings.profile)
    with stage("tracks"):
        assignment = assign_tracks(scheme, tracks, settings.assignment)
    with stage("timing"):
        start = start_of(scheme, tracks, settings.onset_s, settings.at)
    readings = read_tracks(assignment, key, detector, settings.decoy_count, settings.threshold, start, progress)
    channels = tuple(_channel_decoding(channel, readings, scheme) for channel in scheme.channels)
    order_known = settings.onset_s is not None or all(
        order_is_known(decoding.reading, decoding.channel, scheme.schedule)
        for decoding in channels
        if decoding.reading is not None
    )
    present = is_present(readings.evidence, settings.threshold)
    frames: tuple[Delivered, ...] = ()
    posteriors, symbols = _message_symbols(scheme, channels)
    symbols, symbol_nats = _weighed_symbols(symbols, readings)
    # A frame read from a recording without a message would be chance, and a check of few bits would let some pass.
    if scheme.framing is not None and present:
        frames = decode_frames(
            heard_of(readings, scheme), scheme, key.secret, start.first_slot, order_known=order_known
        )
        posteriors, symbols = symbols_of_frame(frames[-1])
        symbol_nats = (None,) * len(symbols)
    weighed = Decoding(
        verdict="absent",
        message=None,
        symbols=symbols,
        posteriors=posteriors,
        symbol_nats=symbol_nats,
        needed_nats=needed_nats(settings.threshold, scheme.alphabet_size, scheme.message_symbols),
        order_known=order_known,
        evidence=readings.evidence,
        channels=channels,
        start=start,
        frames=frames,
        key_id=key.id,
        scheme=scheme,
        settings=settings,
        frame=readings.frame,
    )
    return judged(weighed, settings.threshold), readings


def _weighed_symbols(
    symbols: tuple[int | None, ...], readings: Readings
) -> tuple[tuple[int | None, ...], tuple[float | None, ...]]:
    """The symbols with their log e-values; one with more evidence than the likeliest takes its place."""
    if readings.message is None:
        return symbols, (None,) * len(symbols)
    found = readings.message.symbols
    better = tuple(
        likeliest if weighed is None or likeliest is None else weighed.symbol
        for likeliest, weighed in zip(symbols, found, strict=True)
    )
    return better, tuple(None if weighed is None else weighed.nats for weighed in found)


def heard_of(readings: Readings, scheme: Scheme) -> list[Heard]:
    """The channels that could be read, for their frames."""
    return [
        Heard(channel, readings.channels[channel.name])
        for channel in scheme.channels
        if channel.name in readings.channels
    ]


def symbols_of_frame(frame: Delivered) -> tuple[Floats, tuple[int | None, ...]]:
    """Posteriors (L, M) and decisions of a frame's symbols, each by itself."""
    ratios = frame.ratios
    seen = np.ptp(ratios, axis=1) > 0.0
    symbols = tuple(int(best) if known else None for best, known in zip(np.argmax(ratios, axis=1), seen, strict=True))
    return softmax(ratios, axis=1), symbols


def _channel_decoding(channel: Channel, readings: Readings, scheme: Scheme) -> ChannelDecoding:
    association, body = readings.association, channel.body
    glimpse, result = association.glimpses.get(body), readings.channels.get(channel.name)
    refusal = readings.refusals.get(channel.name)
    also = None if glimpse is None else readings.also_shows.get(glimpse.name)
    return ChannelDecoding(
        channel=channel,
        glimpse=glimpse,
        reading=None if result is None else result.reading,
        posteriors=_unknown(channel, scheme) if result is None else result.posteriors,
        searched=body in association.searched,
        exchanged=body in association.exchanged,
        state=_state(channel, readings, scheme),
        nats=readings.channel_nats.get(channel.name),
        refusal=None if refusal is None else str(refusal),
        also_shows=None if also == channel.name else also,
    )


def _state(channel: Channel, readings: Readings, scheme: Scheme) -> ChannelState:
    if channel.body not in readings.association.glimpses:
        return "unseen"
    if channel.name not in readings.channels:
        return "too short"
    message = readings.message
    if message is None:
        return "read"
    said = readings.channel_nats[channel.name]
    if scheme.framing is None and scheme.combine == "split":
        first = scheme.first_position(channel)
        places = message.symbols[first : first + channel.symbols]
        said = max([said, *(place.nats for place in places if place is not None)])
    return "read" if said > 0.0 else "silent"


def _unknown(channel: Channel, scheme: Scheme) -> Floats:
    return np.full((channel.symbols, scheme.alphabet_size), 1.0 / scheme.alphabet_size)


def _message_symbols(scheme: Scheme, channels: Sequence[ChannelDecoding]) -> tuple[Floats, tuple[int | None, ...]]:
    """Posteriors (L, M) and decisions of the message's positions: joined when split, pooled when the same."""
    if scheme.combine == "split":
        posteriors = np.concatenate([decoding.posteriors for decoding in channels])
        seen = [decoding.reading is not None for decoding in channels for _ in range(decoding.channel.symbols)]
        best = np.argmax(posteriors, axis=1)
        return posteriors, tuple(int(symbol) if known else None for symbol, known in zip(best, seen, strict=True))
    read = [decoding for decoding in channels if decoding.reading is not None]
    scores = np.stack([decoding.reading.scores for decoding in read if decoding.reading is not None])
    pooled = pooled_posteriors(np.stack([decoding.posteriors for decoding in read]))
    return pooled, tuple(pooled_symbols(scores, scheme.pooling))
