"""Evidence for one candidate at one position of a message.

Hypotheses are weighed by what all *other* channels and positions say, which the candidate's waveform has no part in
when another symbol was sent; and to a small part by the prior.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_softmax, logsumexp

from mtm_audit.model.timing import Timing
from mtm_audit.model.track import Floats
from mtm_audit.significance.adaptation import adapted, seen_of
from mtm_audit.significance.channel_terms import ChannelTerms, or_silent
from mtm_audit.significance.likelihood import log_e_of
from mtm_audit.significance.neighbourhood import at_phase_of
from mtm_audit.significance.other_positions import Told
from mtm_audit.significance.sequence import likeliest, weights_of
from mtm_audit.significance.weighed_channel import TableOf, WeighedChannel, alike, anchor, log_prior, selected

Integers = NDArray[np.int64]

# Of a symbol's weights so much come from the others, the rest from the prior.
OTHERS = 0.9
# How many candidates of a position are weighed exactly.
_TRIED = 2


@dataclass(frozen=True)
class SymbolEvidence:
    """The candidate `symbol` of a message position with the most evidence, and its log e-value in nats."""

    symbol: int
    nats: float


def weigh_symbol(own: Sequence[WeighedChannel], showing: Sequence[int], position: int) -> SymbolEvidence:
    """The best of the candidates tried; every channel of `showing`, by its number in `own`, carries the position."""
    channel = own[showing[0]].channel
    row = channel.shown.index(position)
    cost = sum({own[number].channel.name: own[number].cost for number in showing}.values())
    found: list[SymbolEvidence] = []
    for symbol in channel.candidates[row][:_TRIED].tolist():
        found.append(SymbolEvidence(symbol, _symbol_nats(own, showing, position, symbol) + cost))
        # Where one says something no other can say as much.
        if found[-1].nats > 0.0:
            break
    return max(found, key=lambda item: item.nats)


def _symbol_nats(own: Sequence[WeighedChannel], showing: Sequence[int], position: int, symbol: int) -> float:
    """Log e-value of one candidate: by the prior, and by what all others say."""
    by_prior = sum(_by_prior(own[row], position, symbol) for row in showing)
    if len(showing) > 1:
        by_prior = float(np.logaddexp(by_prior, _together(own, showing, position, symbol)) - np.log(2.0))
    by_others = _told_by_others(own, showing, position, symbol)
    if by_others is None:
        return by_prior
    return float(np.logaddexp(by_others + np.log(OTHERS), by_prior + np.log(1.0 - OTHERS)))


def _told_by_others(own: Sequence[WeighedChannel], showing: Sequence[int], position: int, symbol: int) -> float | None:
    """Log e-value under weights of others, at the timing that was found and at those that they show by themselves."""
    told = _told_timings(own, showing, position)
    if told and all(each.covers for each in told.values()):
        return _at_told(own, showing, told, position, symbol)
    found = [_by_others(own, row, showing, position, symbol, _timing(own, row, showing)) for row in showing]
    if any(value is None for value in found):
        return None
    total = float(sum(value for value in found if value is not None))
    if not told:
        return total
    unsure = 1.0 - np.prod([each.sure for each in told.values()])
    return float(np.logaddexp(_at_told(own, showing, told, position, symbol), total + np.log(unsure)))


def _told_timings(own: Sequence[WeighedChannel], showing: Sequence[int], position: int) -> dict[str, Told]:
    """By name what each channel that shows the position is told of its timing; nothing where one cannot be."""
    found: dict[str, Told] = {}
    for row in showing:
        channel = own[row].channel
        if _elsewhere(own, row, showing) or channel.others is None or len(channel.shown) == 1:
            return {}
        if channel.name not in found:
            found[channel.name] = channel.others.told(position, channel.timing, channel.span.numbers)
    return found


def _at_told(
    own: Sequence[WeighedChannel], showing: Sequence[int], told: dict[str, Told], position: int, symbol: int
) -> float:
    """Log e-value of the candidate in all channels, each at the timings that it was told, which its parts share."""
    total = 0.0
    for name, each in told.items():
        rows = [row for row in showing if own[row].channel.name == name]
        values = [-np.inf]
        for timing, log_weight in each.timings:
            parts = [_by_others(own, row, showing, position, symbol, (timing, 0.0)) for row in rows]
            values.append(log_weight + sum(value for value in parts if value is not None))
        total += float(logsumexp(values) + np.log(each.sure))
    return total


def _together(own: Sequence[WeighedChannel], showing: Sequence[int], position: int, symbol: int) -> float:
    """Log e-value of a candidate that several channels carry, each with a waveform of its own, under one hypothesis."""
    items = [own[row] for row in showing]
    channels = [item.channel for item in items]
    places = [_column(channel, position, symbol) for channel in channels]
    if not alike(channels):
        return -np.inf
    tables = [channel.at(anchor(channels, channel)) for channel in channels]

    def said(tables_of: TableOf) -> Floats:
        found = []
        for terms, place in zip(tables, places, strict=True):
            if place is not None:
                found.append(or_silent(tables_of(terms)[..., place[0], place[1]]))
        return np.asarray(np.sum(found, axis=0))

    first = tables[0]
    pairs, chosen, _ = selected(first, first.log_priors, said)
    exact = said(lambda table: table.channel.by_position(table.exact(table.hypotheses(pairs, chosen))))
    return float(logsumexp(exact + log_prior(first.channel, first.log_priors[pairs]).ravel()[chosen]))


def _column(channel: ChannelTerms, position: int, symbol: int) -> tuple[int, int] | None:
    row = channel.shown.index(position)
    columns = np.flatnonzero(channel.candidates[row] == symbol)
    return (row, int(columns[0])) if len(columns) else None


def _by_prior(item: WeighedChannel, position: int, symbol: int) -> float:
    place = _column(item.channel, position, symbol)
    if place is None:
        return 0.0
    exact = item.exact[:, place[0], place[1]]
    # Chosen for the whole channel; for one position others may say more.
    return float(logsumexp(exact + item.chosen[1]))


def _elsewhere(own: Sequence[WeighedChannel], row: int, showing: Sequence[int]) -> list[WeighedChannel]:
    """The channels without the position that may share a hypothesis with this one."""
    others = [other for number, other in enumerate(own) if number not in showing]
    return [other for other in others if alike([own[row].channel, other.channel])]


def _by_others(
    own: Sequence[WeighedChannel],
    row: int,
    showing: Sequence[int],
    position: int,
    symbol: int,
    at: tuple[Timing, float],
) -> float | None:
    """Under weights that channels and positions without this candidate's waveform give; None when there are none.

    `at` is the timing to weigh at, and the log prior that it costs.
    """
    channel = own[row].channel
    place = _column(channel, position, symbol)
    elsewhere = _elsewhere(own, row, showing)
    mine = len(channel.shown) > 1
    if place is None or not (elsewhere or mine):
        return None
    timing, paid = at
    terms = channel.at(timing)

    def said(table_of: TableOf) -> Floats:
        total: Floats = np.zeros(1)
        for other in elsewhere:
            theirs = other.channel
            value = theirs.mixed(table_of(theirs.at(at_phase_of(theirs.timing, timing, theirs.span.window_ticks))))
            total = total + np.logaddexp(value.sum(axis=-1), 0.0)
        if mine:
            values = channel.mixed(table_of(terms), symbol if channel.shared else None)
            total = total + np.delete(values, place[0], axis=-1).sum(axis=-1)
        return total

    pairs, places, log_weights = selected(terms, terms.log_priors, said)
    shares = np.asarray(log_softmax(log_weights))
    chosen = terms.hypotheses(pairs, places)
    table = terms.exact(chosen)
    exact = channel.by_position(table)[:, place[0], place[1]]
    if mine:
        linear, quadratic = weights_of(terms, chosen)
        learned = _learned(channel, linear, quadratic, channel.by_position(table) + shares[:, None, None], place)
        exact = np.logaddexp(exact, learned) - np.log(2.0)
    return float(logsumexp(exact + shares) + paid)


def _timing(own: Sequence[WeighedChannel], row: int, showing: Sequence[int]) -> tuple[Timing, float]:
    """The timing to weigh at, and the log weight that it costs.

    What other channels found costs nothing. A timing that this channel found itself is a choice that the candidate had
    a part in; the parts of a channel share it and pay once.
    """
    channel = own[row].channel
    elsewhere = _elsewhere(own, row, showing)
    if elsewhere:
        return anchor([other.channel for other in elsewhere], channel), 0.0
    first = next(number for number in showing if own[number].channel.name == channel.name)
    timing, log_weight = own[first].channel.centred()
    return timing, log_weight if first == row else 0.0


def _learned(channel: ChannelTerms, linear: Floats, quadratic: Floats, table: Floats, place: tuple[int, int]) -> Floats:
    """Log e-values (hypotheses,) of the candidate at `place` with what the other positions show of each tone.

    `table` (hypotheses, shown positions, k) log e-values, weights of the hypotheses included.
    """
    targets = _targets(channel, place)
    tones = channel.tones[targets, place[1]][:, None]
    linear, quadratic = learned_weights(channel, linear, quadratic, table, place)
    return np.asarray(log_e_of(linear, quadratic, tones, channel.law)[..., 0].sum(axis=1))


def _targets(channel: ChannelTerms, place: tuple[int, int]) -> Integers:
    """The groups that carry the position in that row."""
    return np.flatnonzero(np.searchsorted(np.array(channel.shown), channel.positions) == place[0])


def learned_weights(
    channel: ChannelTerms, linear: Floats, quadratic: Floats, table: Floats, place: tuple[int, int]
) -> tuple[Floats, Floats]:
    """Weights (hypotheses, the position's groups, axes, 2 K) once the other positions have shown each tone.

    `place` and `table` as in `_learned`.
    """
    columns = likeliest(table, np.zeros(len(table)))
    rows = np.searchsorted(np.array(channel.shown), channel.positions)
    targets = _targets(channel, place)
    symbols = channel.candidates[np.arange(len(columns)), columns]
    # Where the candidate itself is the likeliest elsewhere, its waveform would have a say.
    apart = rows != place[0]
    if channel.shared:
        apart &= symbols[rows] != channel.candidates[place]
    used = np.broadcast_to(apart, (len(targets), len(rows)))
    sent = channel.tones[np.arange(len(rows)), columns[rows]]
    return adapted(seen_of(linear, quadratic), sent, used, targets)
