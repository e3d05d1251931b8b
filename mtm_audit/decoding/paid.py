"""A decoding that was one of several tries, with the others paid for."""

import math
from dataclasses import replace

from mtm_audit.decoding.decoding import Decoding
from mtm_audit.decoding.verdict import judged
from mtm_audit.significance.decoys import DecoyComparison


def paid_for(decoding: Decoding, choices: int) -> Decoding:
    """The decoding as one of so many that were tried: its verdict, its evidence and the sureness of its symbols."""
    cost = math.log(choices)
    evidence = decoding.evidence
    paid = replace(
        evidence,
        nats=_less(evidence.nats, cost),
        decoys=None if evidence.decoys is None else _dearer(evidence.decoys, choices),
    )
    frames = tuple(
        replace(frame, message=replace(frame.message, tried=choices * frame.message.tried)) for frame in decoding.frames
    )
    channels = tuple(replace(channel, nats=_less(channel.nats, cost)) for channel in decoding.channels)
    symbols = tuple(_less(nats, cost) for nats in decoding.symbol_nats)
    whole = replace(decoding, evidence=paid, symbol_nats=symbols, frames=frames, channels=channels)
    return judged(whole, decoding.settings.threshold)


def _less(nats: float | None, cost: float) -> float | None:
    return None if nats is None else nats - cost


def _dearer(comparison: DecoyComparison, choices: int) -> DecoyComparison:
    return replace(comparison, p_value=min(1.0, choices * comparison.p_value))


def worth(decoding: Decoding) -> tuple[bool, bool, float]:
    """What makes one try better than another: that it is decoded, that there is a message, and then the evidence."""
    return decoding.verdict == "decoded", decoding.verdict != "absent", decoding.evidence.bits
