"""From how likely each symbol is to the message: payload, number, and how sure that is what was sent."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import logsumexp, softmax

from mtm_audit.decoding.message.codewords import Codewords, likeliest_codewords
from mtm_audit.model.track import Floats
from mtm_onboard.protocol import MtmError, Scheme
from mtm_onboard.protocol.framing import Frame, Framing, Payload
from mtm_onboard.protocol.framing.frame import frame_of_data
from mtm_onboard.protocol.framing.framing import CheckKind, Layout, layout_of
from mtm_onboard.protocol.tag_key import TagKey

# Codewords written out and ranked for one frame. Where 1024 read two frames in five, 4096 read one in twenty to one in
# seven more of them, and take three times as long.
MOST_CANDIDATES = 1024
# A wrong payload passes the checks of one frame with probability 2 ** -12 at most: so a check of c bits is tried on no
# more than 2 ** (c - 12) candidates, which is fewer than MOST_CANDIDATES below 22 bits.
_FALSE_ACCEPTANCE_BITS = 12
# A candidate this much less likely than the first is not tried: the right one has been nearer in all measurements.
_HOPELESS_NATS = 10.0
# This part of all symbols is taken to say nothing true, so that none can outvote all others.
_OUTLIERS = 0.001
_LN2 = float(np.log(2.0))


@dataclass(frozen=True)
class Message:
    """What a frame says, and how sure that is.

    `payload`, `number` (modulo 2 ** number_bits) and `epoch` are None when no candidate is a frame of this scheme; the
    epoch is the one under which the check holds, and None also without a check. `log_odds_nats` compares the frame
    with the likeliest other candidate by their symbols alone, check or no check: below zero the check preferred it to
    a likelier one. `posterior` is the frame's probability among all that could have been sent, tried or not. `tried`
    counts checks made, one for each candidate and epoch.
    """

    payload: Payload | None
    number: int | None
    epoch: int | None
    check: CheckKind
    check_bits: int
    tried: int
    log_odds_nats: float
    posterior: float

    @property
    def check_passed(self) -> bool:
        """Whether a check holds; False also when the scheme's frames have none."""
        return self.check != "none" and self.payload is not None

    @property
    def authenticated(self) -> bool:
        """Whether a keyed tag holds: who wrote the frame knew the key."""
        return self.check == "tag" and self.payload is not None

    @property
    def false_acceptance(self) -> float:
        """Bound on the probability that a payload which was not sent passes one of the checks made; 1 without check."""
        return 1.0 if self.check == "none" else min(1.0, self.tried * 2.0**-self.check_bits)


def decode_message(ratios: Floats, scheme: Scheme, secret: bytes | TagKey, epochs: Sequence[int]) -> Message:
    """Decode one frame from log-likelihood ratios (L, M) in nats, in frame order.

    ratios[p, i] compares "symbol i at p" with anything that is the same for all i; a row of zeros was not seen. Several
    repetitions of a frame are added first (frame_order undoes the interleaving). Candidates are checked from the
    likeliest on, each under all of `epochs`, until one passes. Raises MtmError when the scheme has no framing or the
    ratios are not finite numbers of that shape.
    """
    framing = scheme.framing
    if framing is None:
        raise MtmError("this scheme's messages are plain numbers and not frames; read their symbols one by one")
    shape = (scheme.message_symbols, scheme.alphabet_size)
    if ratios.shape != shape or not np.isfinite(ratios).all():
        raise MtmError(f"the log-likelihood ratios must be finite and of shape {shape}, not {ratios.shape}; give one "
                       "row for each symbol of the frame, zeros where it was not seen")  # fmt: skip
    if not epochs:
        raise MtmError("no epoch is given to decode under; give at least one")
    layout = layout_of(framing, *reversed(shape))
    candidates = likeliest_codewords(_log_posteriors(ratios), layout, MOST_CANDIDATES)
    asked = epochs if framing.check != "none" else epochs[:1]
    found = _first_frame(candidates, framing, secret, asked)
    if found.frame is None:
        return Message(None, None, None, framing.check, framing.check_bits, found.tried, -np.inf, 0.0)
    own = candidates.log_likelihoods[found.row]
    others = np.delete(candidates.log_likelihoods, found.row)
    return Message(
        found.frame.payload,
        found.frame.number,
        None if framing.check == "none" else found.epoch,
        framing.check,
        framing.check_bits,
        found.tried,
        float(own - others.max()) if len(others) else np.inf,
        _posterior(candidates, found.row, framing, layout, len(asked)),
    )


@dataclass(frozen=True)
class _Found:
    frame: Frame | None
    epoch: int | None
    row: int
    tried: int


def _first_frame(candidates: Codewords, framing: Framing, secret: bytes | TagKey, epochs: Sequence[int]) -> _Found:
    log_likelihoods = candidates.log_likelihoods
    hopeful = int(np.sum(log_likelihoods >= log_likelihoods[0] - _HOPELESS_NATS))
    most = hopeful * len(epochs)
    if framing.check != "none":
        most = min(most, 1 << (framing.check_bits - _FALSE_ACCEPTANCE_BITS))
    packed = np.packbits(candidates.data, axis=1)
    unused = -candidates.data.shape[1] % 8
    tried = 0
    for row, content in enumerate(packed[:hopeful]):
        data = int.from_bytes(content.tobytes(), "big") >> unused
        for epoch in epochs:
            if tried == most:
                return _Found(None, None, row, tried)
            tried += 1
            frame = frame_of_data(data, framing, secret, epoch)
            if frame is not None:
                return _Found(frame, epoch, row, tried)
    return _Found(None, None, hopeful, tried)


def _log_posteriors(ratios: Floats) -> Floats:
    """Logarithms (L, M) of the symbols' probabilities, each symbol on its own, with room for one that says nothing."""
    return np.asarray(np.log((1.0 - _OUTLIERS) * softmax(ratios, axis=1) + _OUTLIERS / ratios.shape[1]))


def _posterior(candidates: Codewords, row: int, framing: Framing, layout: Layout, epochs: int) -> float:
    """The frame's probability, by Bayes' rule over all frames.

    The probabilities of all symbol sequences add to one. What the candidates leave over is spread over the others, and
    one in 2 ** (bits that are neither number nor payload) of those is a frame, which counts in place of summing over
    them. Without a code and a check there is no such bit, and this is exact. With a code it is somewhat too low, since
    the codewords near what was seen are candidates and few are left.
    """
    spare_bits = layout.code_symbols * layout.field_bits - (layout.data_bits - framing.check_bits)
    relative = candidates.log_likelihoods - candidates.log_likelihoods[row]
    all_listed = len(relative) == 1 << layout.data_bits
    rest = 0.0 if all_listed else max(0.0, 1.0 - float(np.exp(candidates.log_likelihoods).sum()))
    if framing.check == "none":
        others = np.delete(relative, row)
    else:
        # Those before it are no frames; those after it were not tried, and are frames as often as any.
        others = relative[row + 1 :] + np.log(epochs) - framing.check_bits * _LN2
    unlisted = np.log(rest) if rest else -np.inf
    unlisted += np.log(epochs) - spare_bits * _LN2 - candidates.log_likelihoods[row]
    return float(np.exp(-logsumexp([0.0, unlisted, *others])))
