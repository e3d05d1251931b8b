"""The most likely codewords of a frame, given how likely each symbol is: ordered-statistics list decoding.

The most reliable symbols that fix a whole codeword are the information set; its most likely patterns are written out
to whole codewords, and these are ranked by what all symbols say. Without a code the information set is the message,
and the list is that of the most likely messages. Symbols that are sure and wrong would spoil every pattern, so the
codewords that algebraic decoding finds are ranked with the others.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from mtm_audit.decoding.message.algebraic import corrected_codewords
from mtm_audit.model.track import Floats
from mtm_onboard.protocol.framing.code import encode_symbols
from mtm_onboard.protocol.framing.framing import Layout

Bits = NDArray[np.uint8]
Indices = NDArray[np.int64]


@dataclass(frozen=True)
class Codewords:
    """Distinct codewords, most likely first: `data` (codewords, data_bits) and log-likelihoods (codewords,) in nats."""

    data: Bits
    log_likelihoods: Floats


def likeliest_codewords(ratios: Floats, layout: Layout, count: int) -> Codewords:
    """The likeliest codewords found for log-likelihood ratios (L, M) in nats; rows of zeros stand for unseen symbols.

    `count` of them at most, which is two or more, come from the information set, and few more from algebra.
    """
    carrying = layout.code_symbols * layout.group
    seen = ratios[:carrying]
    pivots, rows = _information_set(seen, layout)
    patterns = _likeliest_patterns(seen, pivots, layout.symbol_bits, count)
    # Whole numbers far below 2 ** 24, so exact; the floating-point product is the one that is fast.
    bits = (patterns.astype(np.float32) @ rows.astype(np.float32)).astype(np.uint16) & 1
    symbols = _numbers(bits.reshape(len(bits), carrying, layout.symbol_bits))
    data = bits[:, : layout.data_bits].astype(np.uint8)
    for corrected in corrected_codewords(ratios, layout)[:, :carrying]:
        own = _bits_of(corrected, layout.symbol_bits)[: layout.data_bits]
        if not (data == own).all(axis=1).any():
            data, symbols = np.vstack([data, own]), np.vstack([symbols, corrected])
    log_likelihoods = np.take(seen, symbols + np.arange(carrying) * seen.shape[1]).sum(axis=1)
    ranked = np.argsort(-log_likelihoods, kind="stable")
    return Codewords(data[ranked], log_likelihoods[ranked])


def _information_set(ratios: Floats, layout: Layout) -> tuple[Indices, Bits]:
    """Bit positions (data_bits,) that fix the codeword, most reliable symbols first, and the codeword of each alone."""
    best = np.partition(ratios, -2, axis=1)[:, -2:]
    symbols = np.argsort(best[:, 0] - best[:, 1], kind="stable")
    columns = (symbols[:, None] * layout.symbol_bits + np.arange(layout.symbol_bits)).ravel()
    width = len(columns)
    # Gauss-Jordan elimination on rows that are whole numbers, the first bit the most significant.
    rows = list(_generator(layout))
    pivots: list[int] = []
    for column in columns.tolist():
        bit, row = 1 << (width - 1 - column), len(pivots)
        found = next((other for other in range(row, len(rows)) if rows[other] & bit), None)
        if found is None:
            continue
        rows[row], rows[found] = rows[found], rows[row]
        pivot = rows[row]
        rows = [other ^ pivot if other & bit else other for other in rows]
        rows[row] = pivot
        pivots.append(column)
        if len(pivots) == layout.data_bits:
            break
    size = -(-width // 8)
    packed = np.frombuffer(b"".join((row << 8 * size - width).to_bytes(size, "big") for row in rows), dtype=np.uint8)
    return np.array(pivots), np.unpackbits(packed.reshape(len(rows), size), axis=1)[:, :width]


def _likeliest_patterns(ratios: Floats, pivots: Indices, symbol_bits: int, count: int) -> Bits:
    """The `count` most likely values (patterns, data_bits) of the information set's bits, each symbol on its own."""
    choices = [
        _choices(
            ratios[symbol], np.flatnonzero(pivots // symbol_bits == symbol), pivots % symbol_bits, symbol_bits, count
        )
        for symbol in sorted(set((pivots // symbol_bits).tolist()))
    ]
    # From the symbol that is most easily something else; one that is too sure to matter ends the search.
    choices.sort(key=lambda choice: float(choice.costs[1]))
    totals = np.zeros(1)
    steps: list[tuple[Indices, Indices]] = []
    for choice in choices:
        most = totals[-1] if len(totals) == count else np.inf
        if choice.costs[1] >= most:
            break
        runs = [np.searchsorted(totals, most - cost) for cost in choice.costs[1:]]
        sums = np.concatenate(
            [totals, *(totals[:run] + cost for run, cost in zip(runs, choice.costs[1:], strict=True))]
        )
        parents = np.concatenate([np.arange(run) for run in (len(totals), *runs)])
        taken = np.repeat(np.arange(len(choice.costs)), [len(totals), *runs])
        kept = np.argsort(sums, kind="stable")[:count]
        totals = sums[kept]
        steps.append((parents[kept], taken[kept]))
    patterns = np.zeros((len(totals), len(pivots)), dtype=np.uint8)
    for choice in choices[len(steps) :]:
        patterns[:, choice.places] = choice.options[0]
    rows = np.arange(len(totals))
    for choice, (parents, taken) in zip(reversed(choices[: len(steps)]), reversed(steps), strict=True):
        patterns[:, choice.places] = choice.options[taken[rows]]
        rows = parents[rows]
    return patterns


@dataclass(frozen=True)
class _Choice:
    """Values of one symbol's bits at `places` of the information set, `options` (n, places), and what each costs."""

    places: Indices
    options: Bits
    costs: Floats


def _choices(ratios: Floats, places: Indices, bit_of_place: Indices, symbol_bits: int, count: int) -> _Choice:
    ranked = np.argsort(-ratios, kind="stable")
    values = (ranked[:, None] >> (symbol_bits - 1 - bit_of_place[places]) & 1).astype(np.uint8)
    if len(places) < symbol_bits:
        # Where only some of a symbol's bits are in the set, the most likely symbol that agrees speaks for them.
        _, first = np.unique(_numbers(values), return_index=True)
        first.sort()
        values, ranked = values[first], ranked[first]
    return _Choice(places, values[:count], ratios[ranked[0]] - ratios[ranked[:count]])


@lru_cache(maxsize=8)
def _generator(layout: Layout) -> tuple[int, ...]:
    """Codewords (data_bits) of the data with a single one, most significant first, each as a number."""
    data = [1 << place for place in reversed(range(layout.data_bits))]
    carrying = layout.code_symbols * layout.group
    words = []
    for symbols in encode_symbols(data, layout):
        word = 0
        for symbol in symbols[:carrying]:
            word = word << layout.symbol_bits | symbol
        words.append(word)
    return tuple(words)


def _bits_of(symbols: Indices, symbol_bits: int) -> Bits:
    return (symbols[:, None] >> np.arange(symbol_bits)[::-1] & 1).astype(np.uint8).ravel()


def _numbers(bits: NDArray[np.integer[Any]]) -> Indices:
    """The whole numbers whose bits stand along the last axis, most significant first."""
    numbers = bits[..., 0].astype(np.int64)
    for place in range(1, bits.shape[-1]):
        numbers = numbers << 1 | bits[..., place]
    return numbers
