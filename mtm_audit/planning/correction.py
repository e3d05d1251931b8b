"""What Reed-Solomon codes would cost and bring: the paper's overhead table, and a plan with and without a code."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from mtm_audit.planning.plan import Plan, symbols_needed

# The paper's goals: one of eight, so that a goal is one symbol of GF(8).
GOAL_BITS = 3
ALPHABET_SIZES = (8, 4, 2)


@dataclass(frozen=True)
class Code:
    """RS(n, k) over GF(2 ** field_bits): n field symbols, k of them data."""

    length: int
    data: int
    field_bits: int

    @property
    def errors(self) -> int:
        """Wrong field symbols that it corrects."""
        return (self.length - self.data) // 2

    @property
    def overhead(self) -> float:
        """Field symbols sent for each one of data."""
        return self.length / self.data


@dataclass(frozen=True)
class Coded:
    """A plan with a code on top, its windows unchanged: predicted accuracy and length."""

    code: Code
    message_ticks: int
    accuracy: float


def best_goal_code(errors: int) -> Code:
    """The code over GF(8) of least redundancy that corrects so many goals: the longest one, RS(7, 7 - 2 errors)."""
    length = (1 << GOAL_BITS) - 1
    return Code(length, length - 2 * errors, GOAL_BITS)


def overhead_table() -> list[tuple[Code, dict[int, float]]]:
    """The paper's table of overhead factors: for each code the factor on T per data goal, by alphabet size M.

    The factor counts symbols of the channel for each data goal: n / k goals of ceil(3 / log2 M) symbols each.
    """
    rows = []
    for errors in range(1, (1 << GOAL_BITS) // 2):
        code = best_goal_code(errors)
        rows.append((code, {M: code.overhead * symbols_needed(GOAL_BITS, M) for M in ALPHABET_SIZES}))
    return rows


def two_digits(factor: float) -> str:
    """A factor as the paper prints it: two significant digits, trailing zeros kept."""
    decimals = max(0, 1 - math.floor(math.log10(factor)))
    return f"{factor:.{decimals}f}"


def coded(plan: Plan, payload_bits: int, errors: int) -> Coded | None:
    """The plan with a code that corrects `errors` field symbols; None when M is not a power of two or no code fits.

    A field symbol is a group of channel symbols, in the smallest field that holds the codeword. Codewords are dealt to
    the channels as the plan deals symbols, and errors are taken as independent.
    """
    code = _code(payload_bits, plan.alphabet_size, errors)
    if code is None:
        return None
    group = code.field_bits // int(math.log2(plan.alphabet_size))
    dealt = _dealt(code.length, [count for _, count in plan.parts])
    ticks, rights = 0, []
    for (curve, count), own in zip(plan.parts, dealt, strict=True):
        window_ticks = plan.message_ticks // count
        ticks = max(ticks, own * group * window_ticks)
        rights += [curve.accuracy(window_ticks) ** group] * own
    return Coded(code, ticks, at_most(code.errors, rights))


def at_most(errors: int, rights: Sequence[float]) -> float:
    """Probability that at most so many of independent symbols, right with these probabilities, are wrong."""
    wrong = np.zeros(len(rights) + 1)
    wrong[0] = 1.0
    for right in rights:
        wrong[1:] = right * wrong[1:] + (1.0 - right) * wrong[:-1]
        wrong[0] *= right
    return float(min(1.0, wrong[: errors + 1].sum()))


def _code(payload_bits: int, alphabet_size: int, errors: int) -> Code | None:
    symbol_bits = alphabet_size.bit_length() - 1
    if alphabet_size != 1 << symbol_bits:
        return None
    for field_bits in range(symbol_bits, 17, symbol_bits):
        data = -(-payload_bits // field_bits)
        if data + 2 * errors < 1 << field_bits:
            return Code(data + 2 * errors, data, field_bits)
    return None


def _dealt(total: int, weights: Sequence[int]) -> list[int]:
    """Whole numbers in proportion to `weights` that add up to `total`, by largest remainders."""
    exact = [total * weight / sum(weights) for weight in weights]
    dealt = [math.floor(value) for value in exact]
    by_remainder = sorted(range(len(exact)), key=lambda place: dealt[place] - exact[place])
    for place in by_remainder[: total - sum(dealt)]:
        dealt[place] += 1
    return dealt
