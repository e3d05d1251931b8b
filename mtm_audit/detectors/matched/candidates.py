"""Candidates' tones, derived when asked for: a large alphabet is never held for all windows at once.

Those of a whole alphabet are kept in single precision while they fit in a budget, and derived again when they do not.
"""

from collections import OrderedDict
from collections.abc import Sequence
from functools import cached_property
from typing import overload
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from mtm_audit.model.track import Floats
from mtm_onboard.protocol.codebook import Codebook
from mtm_onboard.protocol.scheme import Channel

Tones = NDArray[np.float32]
Integers = NDArray[np.int64]

# Alphabets up to this size are held and weighed whole; of larger ones what is weighed closely is chosen first.
WHOLE = 1024
# All codebooks together may keep so many bytes of tones.
_BUDGET_BYTES = 160_000_000
# Symbols that are derived together: what is needed on the way takes several times the tones themselves.
_BLOCK = 4096

_kept: WeakKeyDictionary[Codebook, "OrderedDict[tuple[Channel, int], Tones]"] = WeakKeyDictionary()


def stacked_tones(codebook: Codebook, channel: Channel, number: int, symbols: Sequence[int] | None = None) -> Tones:
    """Candidates' tones in the layout of `Heard.projections`, all unless `symbols` are named: (M, axes, 2 K).

    Those of a whole large alphabet are kept as the budget allows, and read-only.
    """
    if symbols is not None or codebook.scheme.alphabet_size <= WHOLE:
        tones = codebook.tones(channel, number, symbols)
        return np.concatenate([tones.real, -tones.imag], axis=-1).astype(np.float32)
    own = _kept.setdefault(codebook, OrderedDict())
    place = (channel, 0 if codebook.scheme.schedule == "fixed" else number)
    if place in own:
        own.move_to_end(place)
        return own[place]
    derived = _whole(codebook, channel, number)
    _make_room(derived.nbytes)
    if derived.nbytes <= _BUDGET_BYTES:
        own[place] = derived
    return derived


def _kept_tones(codebook: Codebook, channel: Channel, number: int) -> Tones | None:
    """`stacked_tones` of a whole large alphabet where they are at hand."""
    place = (channel, 0 if codebook.scheme.schedule == "fixed" else number)
    return _kept.get(codebook, OrderedDict()).get(place)


def forget(codebook: Codebook) -> None:
    """Keep no more of a codebook's tones: they are derived again when they are asked for."""
    _kept.pop(codebook, None)


def _whole(codebook: Codebook, channel: Channel, number: int) -> Tones:
    """All candidates' tones, a block of symbols after the other."""
    count = codebook.scheme.alphabet_size
    result = np.empty((count, len(channel.axes), 2 * len(codebook.bins(channel))), dtype=np.float32)
    for first in range(0, count, _BLOCK):
        block = range(first, min(first + _BLOCK, count))
        result[first : block.stop] = stacked_tones(codebook, channel, number, block)
    result.flags.writeable = False
    return result


def _make_room(size: int) -> None:
    """Forget what was asked for least lately in the codebook that keeps most, until `size` bytes are free."""
    while True:
        used = {codebook: sum(tones.nbytes for tones in own.values()) for codebook, own in list(_kept.items())}
        if not used or sum(used.values()) + size <= _BUDGET_BYTES or not any(used.values()):
            return
        _kept[max(used, key=lambda codebook: used[codebook])].popitem(last=False)


class WindowTones:
    """The candidates of one window; of a large alphabet they are known in single precision."""

    def __init__(self, codebook: Codebook, channel: Channel, number: int) -> None:
        self._codebook, self._channel, self._number = codebook, channel, number
        self.shape = (codebook.scheme.alphabet_size, len(channel.axes), 2 * len(codebook.bins(channel)))

    def __len__(self) -> int:
        return self.shape[0]

    @property
    def whole(self) -> Tones:
        """Real parts and negative imaginary parts of all candidates' tones, (M, axes, 2 K)."""
        return stacked_tones(self._codebook, self._channel, self._number)

    def ratios(self, linear: Floats, quadratic: Floats) -> Floats:
        """T . linear - t' quadratic t / 2 of each candidate's tones t, all axes' side by side as in `of`: (M,)."""
        count, axes, width = self.shape
        if count <= WHOLE:
            flat = self._held.reshape(count, axes * width)
            return np.asarray(flat @ linear - 0.5 * np.einsum("lk,lk->l", flat @ quadratic, flat))
        # Imaginary parts have the other sign in what is kept.
        sign = np.tile(np.repeat([1.0, -1.0], width // 2), axes)
        pull, bend = (sign * linear).astype(np.float32), (np.outer(sign, sign) * quadratic).astype(np.float32)
        whole = self.whole.reshape(count, axes * width)
        return np.concatenate(
            [
                (block @ pull - np.float32(0.5) * np.einsum("lk,lk->l", block @ bend, block)).astype(np.float64)
                for block in np.array_split(whole, -(-count // _BLOCK))
            ]
        )

    def of(self, symbols: Integers) -> Floats:
        """Real and imaginary parts of the symbols' tones, side by side: (symbols, axes, 2 K)."""
        if len(self) <= WHOLE:
            return self._held[symbols]
        kept = _kept_tones(self._codebook, self._channel, self._number)
        if kept is None:
            return self._derived(symbols.tolist())
        # Imaginary parts have the other sign in what is kept.
        return np.asarray(kept[symbols] * np.repeat([1.0, -1.0], self.shape[2] // 2))

    @cached_property
    def _held(self) -> Floats:
        return self._derived(range(len(self)))

    def _derived(self, symbols: Sequence[int]) -> Floats:
        tones = self._codebook.tones(self._channel, self._number, symbols)
        return np.concatenate([tones.real, tones.imag], axis=-1)


class LazyTones(Sequence[Tones]):
    """`stacked_tones` of a channel's first windows, each derived when it is first looked at.

    Small alphabets are held; large ones are derived again where they were not kept.
    """

    def __init__(self, codebook: Codebook, channel: Channel, windows: int) -> None:
        self._codebook, self._channel, self._windows = codebook, channel, windows
        self._held: dict[int, Tones] = {}

    def __len__(self) -> int:
        return self._windows

    @overload
    def __getitem__(self, number: int) -> Tones: ...
    @overload
    def __getitem__(self, number: slice) -> Sequence[Tones]: ...
    def __getitem__(self, number: int | slice) -> Tones | Sequence[Tones]:
        if isinstance(number, slice):
            return [self[each] for each in range(*number.indices(self._windows))]
        if not 0 <= number < self._windows:
            raise IndexError(number)
        if number in self._held:
            return self._held[number]
        tones = stacked_tones(self._codebook, self._channel, number)
        if len(tones) <= WHOLE:
            self._held[number] = tones
        return tones
