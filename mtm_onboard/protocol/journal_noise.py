"""The noise that a journal leaves out, made again with the key."""

from dataclasses import replace

import numpy as np

from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.journal_file import CLAMPED, JournalRecord
from mtm_onboard.protocol.key import Key

# The journal's columns of velocities.
_AXES = ("vx", "vy", "wz")


def with_noise(record: JournalRecord, key: Key) -> JournalRecord:
    """The record with what was sent in ticks with noise: base plus the noise of the slot that was played.

    It stays NaN in ticks that a limit cut, since that depends on the robot's limits, and in ticks of no slot that the
    journal still has. Raises MtmError when the key is not that of the journal, or not for its days or its channel.
    """
    header, scheme = record.header, key.scheme
    if (header.key_id, header.fingerprint) != (key.id, scheme.fingerprint):
        raise MtmError(
            f"the journal is of key {header.key_id} and scheme {header.fingerprint}, and the key file of {key.id} and "
            f"{scheme.fingerprint}; name the key that the run had"
        )
    channel = scheme.channel(header.channel)
    if not set(channel.axes) <= set(_AXES):
        raise MtmError(f"channel {channel.name} has axes that no journal has columns for; name another journal")
    columns = [_AXES.index(axis) for axis in channel.axes]
    unknown = np.isnan(record.sent).all(axis=1) & ((record.flags & CLAMPED) == 0)
    sent = record.sent.copy()
    for slot in record.slots:
        ticks = record.ticks - slot.first_tick
        rows = np.flatnonzero(unknown & (ticks >= 0) & (ticks < scheme.message_ticks))
        if not len(rows):
            continue
        codebook, windows = key.codebook(slot.slot), range(channel.symbols)
        if len(slot.symbols) != channel.symbols:
            raise MtmError("the journal's symbols are not those of its channel; name the key that the run had")
        samples = [codebook.samples(channel, window, [slot.symbols[window]])[0] for window in windows]
        noise = np.array(channel.sigmas)[:, None] * np.concatenate(samples, axis=1)
        sent[rows] = record.base[rows]
        for column, axis in zip(columns, noise, strict=True):
            sent[rows, column] += axis[ticks[rows]]
    return replace(record, sent=sent)
