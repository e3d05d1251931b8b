"""The verdict: what a decoding's evidence says at a threshold."""

from dataclasses import replace

from mtm_audit.decoding.decoding import CERTAIN, Decoding
from mtm_audit.significance.evidence import Evidence, needed_nats
from mtm_onboard.protocol.framing import Payload, number_of_symbols


def judged(decoding: Decoding, threshold: float) -> Decoding:
    """The decoding with the verdict, the message and the bound of its symbols at `threshold`; nothing is weighed anew.

    Every decode answers with it. Of a plain message it gives at any threshold what a decode at that one
    would, as long as both associate tracks alike. Raises ValueError for a framed message that is present at this
    threshold and was not where it was decoded, since its frames have not been read.
    """
    scheme, settings = decoding.scheme, replace(decoding.settings, threshold=threshold)
    needed = needed_nats(threshold, scheme.alphabet_size, scheme.message_symbols)
    asked = replace(decoding, verdict="absent", message=None, needed_nats=needed, settings=settings)
    if not is_present(decoding.evidence, threshold):
        return asked
    message = _message_of(asked)
    if message is None:
        return replace(asked, verdict="inconclusive")
    return replace(asked, verdict="decoded", message=message)


def is_present(evidence: Evidence, threshold: float) -> bool:
    """Whether the evidence for any message of the key reaches the threshold."""
    return evidence.p_value <= threshold


def _message_of(decoding: Decoding) -> Payload | None:
    """What a present message says; None when that is uncertain."""
    framing = decoding.scheme.framing
    if framing is not None:
        if not decoding.frames:
            raise ValueError("the frames of this message have not been read; decode it at this threshold")
        read = decoding.frames[-1].message
        # Without a check the order of the symbols and the likeliest codeword are all there is.
        sure = read.check_passed or (framing.check == "none" and decoding.order_known and read.posterior >= CERTAIN)
        return read.payload if sure else None
    if decoding.uncertain or not decoding.order_known:
        return None
    return number_of_symbols([symbol for symbol in decoding.symbols if symbol is not None], decoding.scheme)
