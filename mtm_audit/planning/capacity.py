"""The capacity of a channel that gets symbols right or wrong, and how a long message is shared out by it."""

import numpy as np
from scipy.special import xlogy

from mtm_audit.model.track import Floats


def capacity_bits(accuracy: float | Floats, alphabet_size: int) -> Floats:
    """C_M(a) in bits a symbol (the paper's equation for the M-ary symmetric channel); any shape.

    log2 M at a = 1 and zero at a = 1/M; below that the formula rises again, since wrong symbols then tell something.
    """
    a = np.asarray(accuracy, dtype=np.float64)
    entropy = -(xlogy(a, a) + xlogy(1.0 - a, 1.0 - a)) / np.log(2.0)
    bits: Floats = np.log2(alphabet_size) - entropy - (1.0 - a) * np.log2(alphabet_size - 1)
    return bits


def capacity_shares(accuracies: Floats, alphabet_size: int) -> Floats:
    """Each channel's share of the symbols, in proportion to its capacity; (channels,), sums to 1.

    Accuracies at chance or below count as no capacity; equal shares when no channel has any.
    """
    bits = np.maximum(0.0, capacity_bits(np.maximum(accuracies, 1.0 / alphabet_size), alphabet_size))
    total = bits.sum()
    shares: Floats = bits / total if total > 0.0 else np.full(len(bits), 1.0 / len(bits))
    return shares
