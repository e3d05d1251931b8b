"""Evidence for a message and for each of its symbols, by e-values over the key.

Hypotheses say at which timing, through which plant, with which gains a waveform reached the recording, and have prior
probabilities that were fixed before. A mixture of e-values with such weights is one, leaving terms out only lowers it,
and so the terms may be chosen in any way. Two mixtures are made.

- *Presence*: over hypotheses, channels and messages. Channels share a hypothesis, or have each its own, or say nothing.
- *This symbol*: for one position and one candidate, over hypotheses weighed by what all *other* channels and positions
  say, which the candidate's waveform has no part in when another symbol was sent; and to a small part by the prior.

docs/evidence.md has the theorem, and what is random and what is fixed in it.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_softmax, logsumexp

from mtm_audit.model.timing import Timing
from mtm_audit.model.track import Floats
from mtm_audit.significance.channel_terms import ChannelTerms, Terms, or_silent
from mtm_audit.significance.gains import all_levels
from mtm_audit.significance.likelihood import Hypotheses
from mtm_audit.significance.neighbourhood import at_phase_of

Integers = NDArray[np.int64]

# Of a symbol's weights so much come from the others, the rest from the prior.
_OTHERS = 0.9
_PAIRS = 6
_HYPOTHESES = 32
# How many candidates of a position are weighed exactly.
_TRIED = 2


@dataclass(frozen=True)
class SymbolEvidence:
    """The candidate `symbol` of a message position with the most evidence, and its log e-value in nats."""

    symbol: int
    nats: float


@dataclass(frozen=True)
class MessageEvidence:
    """`presence_nats`: log e-value of any message of the key; `channels_nats`: of each channel by itself, in the order
    given; `symbols`: by message position, None where no channel shows it.
    """

    presence_nats: float
    channels_nats: tuple[float, ...]
    symbols: tuple[SymbolEvidence | None, ...]

    def discounted(self, nats: float) -> "MessageEvidence":
        """The same where this was one of several hypotheses, whose log prior probability is `-nats`."""
        symbols = (None if item is None else SymbolEvidence(item.symbol, item.nats - nats) for item in self.symbols)
        channels = (item - nats for item in self.channels_nats)
        return MessageEvidence(self.presence_nats - nats, tuple(channels), tuple(symbols))

    def by_channel(self, firsts: Sequence[int]) -> "MessageEvidence":
        """The same with channels that were weighed in parts put together; a channel's parts begin at each of `firsts`.

        A part that shows nothing is taken for silent, at even odds.
        """
        bounds = [*firsts, len(self.channels_nats)]
        parts = [np.array(self.channels_nats[first:last]) for first, last in pairwise(bounds)]
        whole = (
            float(each[0]) if len(each) == 1 else float(np.sum(np.logaddexp(each, 0.0) - np.log(2.0))) for each in parts
        )
        return MessageEvidence(self.presence_nats, tuple(whole), self.symbols)


def weigh_message(
    channels: Sequence[ChannelTerms], costs: Sequence[float], positions: int, *, symbols: bool = True
) -> MessageEvidence:
    """What the channels that could be read say together of a message of so many positions.

    `costs` are log prior probabilities of the track that was chosen for each channel. Without `symbols` only presence
    is weighed: a frame's symbols have a check of their own.
    """
    own = [_Own(channel, channel.at(channel.timing), cost) for channel, cost in zip(channels, costs, strict=True)]
    found: list[SymbolEvidence | None] = [None] * positions
    for position in range(positions if symbols else 0):
        showing = [row for row, channel in enumerate(channels) if position in channel.shown]
        if showing:
            found[position] = _symbol(own, showing, position)
    return MessageEvidence(_presence(own), tuple(item.nats for item in own), tuple(found))


@dataclass(frozen=True)
class _Own:
    """A channel by itself, at its own timing, whose prior is paid for."""

    channel: ChannelTerms
    terms: Terms
    cost: float

    @cached_property
    def chosen(self) -> tuple[Hypotheses, Floats]:
        """The hypotheses that say most under the prior, and their log priors."""
        channel, terms = self.channel, self.terms
        pairs, places, _ = _selected(terms, lambda table_of: channel.mixed(table_of(terms)).sum(axis=-1))
        return terms.hypotheses(pairs, places), _prior(terms, pairs).ravel()[places]

    @cached_property
    def nats(self) -> float:
        """Log e-value of any message on this channel."""
        chosen, log_priors = self.chosen
        return float(logsumexp(self.terms.exact_presence(chosen) + log_priors)) + self.cost

    @cached_property
    def exact(self) -> Floats:
        """Exact log e-values by position under the chosen hypotheses, (hypotheses, shown positions, k)."""
        return self.channel.by_position(self.terms.exact(self.chosen[0]))


def _prior(terms: Terms, pairs: Integers) -> Floats:
    """Log priors (pairs, levels, orientations)."""
    levels = all_levels().log_priors[:, None] - np.log(len(terms.channel.turns))
    cameras = np.broadcast_to(levels, (len(levels), len(terms.channel.turns)))
    return np.asarray(terms.log_priors[pairs][:, None, None] + cameras)


# Takes one of a channel's tables out of its terms, and what channels say by such tables.
_TableOf = Callable[[Terms], Floats]
_Said = Callable[[_TableOf], Floats]


def _selected(terms: Terms, said: _Said) -> tuple[Integers, Integers, Floats]:
    """The hypotheses of which most is said, prior included: pairs, places in their fine table, log weights of these."""
    pairs = _largest(logsumexp(said(lambda table: table.coarse), axis=(1, 2)) + terms.log_priors, _PAIRS)
    fine = (said(lambda table: table.fine(pairs)) + _prior(terms, pairs)).ravel()
    places = _largest(fine, _HYPOTHESES)
    return pairs, places, fine[places]


def _largest(values: Floats, count: int) -> Integers:
    """Places of the largest values, any order."""
    count = min(count, len(values))
    return np.argpartition(-values, count - 1)[:count]


def _anchor(channels: Sequence[ChannelTerms], channel: ChannelTerms) -> Timing:
    """The timing of the channel in `channels` that shows most, as `channel` counts its windows.

    What that channel found by itself: a timing that `channel` had a say in would depend on its candidates.
    """
    strongest = max(channels, key=lambda other: other.strength)
    return at_phase_of(channel.timing, strongest.alone, channel.span.window_ticks)


def _alike(channels: Sequence[ChannelTerms]) -> bool:
    """Whether hypotheses can be shared: one table's shape for all."""
    return len({(channel.turns.shape, channel.span.step_s) for channel in channels}) == 1


def _presence(own: Sequence[_Own]) -> float:
    """Each channel shares the hypothesis of all, or has its own, or is silent, at a third each."""
    apart = np.array([item.nats for item in own])
    alone = float(np.sum(np.logaddexp(apart, 0.0) - np.log(2.0)))
    channels = [item.channel for item in own]
    if len(own) == 1:
        return float(apart[0])
    if not _alike(channels):
        return _presence_by_kind(own)
    tables = [channel.at(_anchor(channels, channel)) for channel in channels]

    def together(values: Sequence[Floats]) -> Floats:
        blurred = [_blurred(value + item.cost, item.nats) for value, item in zip(values, own, strict=True)]
        return np.asarray(np.sum(blurred, axis=0))

    coarse = [logsumexp(channel.mixed(terms.coarse).sum(axis=-1), axis=(1, 2)) - np.log(terms.coarse[0, ..., 0, 0].size)
              for channel, terms in zip(channels, tables, strict=True)]  # fmt: skip
    first = tables[0]
    pairs = _largest(together(coarse) + first.log_priors, _PAIRS)
    fine = together([channel.mixed(terms.fine(pairs)).sum(axis=-1)
                     for channel, terms in zip(channels, tables, strict=True)]) + _prior(first, pairs)  # fmt: skip
    places = _largest(fine.ravel(), _HYPOTHESES)
    exact = together([terms.exact_presence(terms.hypotheses(pairs, places)) for terms in tables])
    shared = float(logsumexp(exact + _prior(first, pairs).ravel()[places]))
    return float(np.logaddexp(shared, alone) - np.log(2.0))


def _presence_by_kind(own: Sequence[_Own]) -> float:
    """Channels that can share a hypothesis together, and the kinds apart."""
    kinds: list[list[_Own]] = []
    for item in own:
        mine = next((kind for kind in kinds if _alike([kind[0].channel, item.channel])), None)
        if mine is None:
            kinds.append([item])
        else:
            mine.append(item)
    apart = np.array([_presence(kind) for kind in kinds])
    return float(np.sum(np.logaddexp(apart, 0.0) - np.log(2.0)))


def _blurred(shared: Floats, own: float) -> Floats:
    """Log of the mean of the shared e-values, the channel's own one, and 1."""
    return np.asarray(np.logaddexp(np.logaddexp(shared, own), 0.0) - np.log(3.0))


def _symbol(own: Sequence[_Own], showing: Sequence[int], position: int) -> SymbolEvidence:
    """The best of the candidates tried; every channel of `showing` carries the position."""
    channel = own[showing[0]].channel
    row = channel.shown.index(position)
    cost = sum(own[number].cost for number in showing)
    found: list[SymbolEvidence] = []
    for symbol in channel.candidates[row][:_TRIED].tolist():
        found.append(SymbolEvidence(symbol, _symbol_nats(own, showing, position, symbol) + cost))
        # Where one says something no other can say as much.
        if found[-1].nats > 0.0:
            break
    return max(found, key=lambda item: item.nats)


def _symbol_nats(own: Sequence[_Own], showing: Sequence[int], position: int, symbol: int) -> float:
    """Log e-value of one candidate: by the prior, and by what all others say."""
    by_prior = sum(_by_prior(own[row], position, symbol) for row in showing)
    if len(showing) > 1:
        by_prior = float(np.logaddexp(by_prior, _together(own, showing, position, symbol)) - np.log(2.0))
    others = [_by_others(own, row, showing, position, symbol) for row in showing]
    if any(value is None for value in others):
        return by_prior
    by_others = sum(value for value in others if value is not None)
    return float(np.logaddexp(by_others + np.log(_OTHERS), by_prior + np.log(1.0 - _OTHERS)))


def _together(own: Sequence[_Own], showing: Sequence[int], position: int, symbol: int) -> float:
    """Log e-value of a candidate that several channels carry, each with a waveform of its own, under one hypothesis."""
    items = [own[row] for row in showing]
    channels = [item.channel for item in items]
    places = [_column(channel, position, symbol) for channel in channels]
    if not _alike(channels):
        return -np.inf
    tables = [channel.at(_anchor(channels, channel)) for channel in channels]

    def said(tables_of: _TableOf) -> Floats:
        found = []
        for channel, terms, place in zip(channels, tables, places, strict=True):
            if place is not None:
                found.append(or_silent(channel.by_position(tables_of(terms))[..., place[0], place[1]]))
        return np.asarray(np.sum(found, axis=0))

    first = tables[0]
    pairs, chosen, _ = _selected(first, said)
    exact = said(lambda table: table.exact(table.hypotheses(pairs, chosen)))
    return float(logsumexp(exact + _prior(first, pairs).ravel()[chosen]))


def _column(channel: ChannelTerms, position: int, symbol: int) -> tuple[int, int] | None:
    row = channel.shown.index(position)
    columns = np.flatnonzero(channel.candidates[row] == symbol)
    return (row, int(columns[0])) if len(columns) else None


def _by_prior(item: _Own, position: int, symbol: int) -> float:
    place = _column(item.channel, position, symbol)
    if place is None:
        return 0.0
    exact = item.exact[:, place[0], place[1]]
    # Chosen for the whole channel; for one position others may say more.
    return float(logsumexp(exact + item.chosen[1]))


def _by_others(own: Sequence[_Own], row: int, showing: Sequence[int], position: int, symbol: int) -> float | None:
    """Under weights that channels and positions without this candidate's waveform give; None when there are none."""
    item = own[row]
    channel = item.channel
    place = _column(channel, position, symbol)
    others = [other for number, other in enumerate(own) if number not in showing]
    elsewhere = [other for other in others if _alike([channel, other.channel])]
    mine = len(channel.shown) > 1
    if place is None or not (elsewhere or mine):
        return None
    # A timing that this channel found itself is a choice that the candidate had a part in, and is paid for.
    timing = _anchor([other.channel for other in elsewhere], channel) if elsewhere else channel.timing
    terms = channel.at(timing)
    paid = 0.0 if elsewhere else terms.log_prior

    def said(table_of: _TableOf) -> Floats:
        total: Floats = np.zeros(1)
        for other in elsewhere:
            theirs = other.channel
            value = theirs.mixed(table_of(theirs.at(at_phase_of(theirs.timing, timing, theirs.span.window_ticks))))
            total = total + np.logaddexp(value.sum(axis=-1), 0.0)
        if mine:
            values = channel.mixed(table_of(terms), symbol if channel.shared else None)
            total = total + np.delete(values, place[0], axis=-1).sum(axis=-1)
        return total

    pairs, places, log_weights = _selected(terms, said)
    exact = channel.by_position(terms.exact(terms.hypotheses(pairs, places)))[:, place[0], place[1]]
    return float(logsumexp(exact + log_softmax(log_weights)) + paid)
