"""Message slots: when a message begins under the rolling schedule, and which waveforms it has.

Slot s is one message of T ticks and starts s * T / rate_hz seconds after the Unix epoch, so that robot and auditor
agree on it by their clocks alone. The keyed stream counts slots anew in each epoch, which is a whole day in UTC.
"""

import math
from fractions import Fraction

from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.scheme import Scheme

EPOCH_S = 86_400

# Sums and decimal texts of today's times are off by less.
_HAIR_S = 1e-6


def slot_at(unix_s: float, scheme: Scheme) -> int:
    """The slot that is under way at `unix_s`: the last one that has started. Raises MtmError for what is no time."""
    if not math.isfinite(unix_s):
        raise MtmError(f"the time {unix_s} is not a number of seconds since the Unix epoch; give one")
    slot = math.floor(Fraction(unix_s) / _slot_s(scheme))
    # Starts are rounded to floating point, and a start belongs to its own slot.
    return slot + 1 if slot_start_unix_s(slot + 1, scheme) <= unix_s else slot


def next_slot(unix_s: float, scheme: Scheme) -> int:
    """The first slot that starts at `unix_s` or later, a microsecond earlier at most; raises MtmError for no time."""
    slot = slot_at(unix_s, scheme)
    return slot if slot_start_unix_s(slot, scheme) >= unix_s - _HAIR_S else slot + 1


def slot_start_unix_s(slot: int, scheme: Scheme) -> float:
    """When the slot starts, in seconds since the Unix epoch."""
    return float(slot * _slot_s(scheme))


def epoch_of_slot(slot: int, scheme: Scheme) -> tuple[int, int]:
    """The slot's epoch and its number in it: the slots that start in one day count from 0.

    A slot that starts before midnight belongs to its day whole. Raises MtmError for a slot before the Unix epoch.
    """
    if slot < 0:
        raise MtmError(f"slot {slot} starts before the year 1970, which has no waveforms; set the clock")
    slot_s = _slot_s(scheme)
    day = slot * slot_s // EPOCH_S
    return scheme.epoch + day, slot - math.ceil(day * EPOCH_S / slot_s)


def last_slot_of_epoch(epoch: int, scheme: Scheme) -> int:
    """The last slot that starts in the epoch."""
    return math.ceil((epoch - scheme.epoch + 1) * EPOCH_S / _slot_s(scheme)) - 1


def _slot_s(scheme: Scheme) -> Fraction:
    # As the rate is written: 49.95 Hz means 49.95 and not the binary number next to it, whose days drift.
    return scheme.message_ticks / Fraction(str(scheme.rate_hz))
