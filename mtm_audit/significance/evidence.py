"""How much a recording says for a key: an e-value over keys, or a comparison with decoys, or both."""

import math
from dataclasses import dataclass

from mtm_audit.significance.decoys import DecoyComparison

# Smaller probabilities are printed and written as this one.
_LEAST_P = 1e-300


@dataclass(frozen=True)
class Evidence:
    """`nats`: log e-value of any message of the key, None from a detector that gives none; `decoys`: the comparison
    with keys that nobody holds, None when none were asked for. One of the two is there.
    """

    nats: float | None
    decoys: DecoyComparison | None = None

    @property
    def p_value(self) -> float:
        """How often a recording that the key had no part in shows as much, at most.

        By Markov's inequality from the e-value, for every recording; else as the decoys show.
        """
        if self.nats is not None:
            return max(math.exp(-max(self.nats, 0.0)), _LEAST_P)
        return 1.0 if self.decoys is None else self.decoys.p_value

    @property
    def bits(self) -> float:
        """The log e-value in bits, negative where the recording speaks against a message; else -log2 of the p-value."""
        if self.nats is not None:
            return self.nats / math.log(2.0)
        return -math.log2(max(self.p_value, _LEAST_P))


def needed_nats(threshold: float, alphabet_size: int, positions: int) -> float:
    """Log e-value from which on a symbol counts, so that any of `positions` is wrong with probability `threshold`.

    Each of the other M - 1 symbols of a position reaches e with probability 1 / e at most.
    """
    return math.log(max(1, alphabet_size - 1) * positions / threshold)
