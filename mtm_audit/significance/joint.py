"""Evidence of several recordings of one message.

Recordings that show the same waveforms, two films of one message or two days of a fixed schedule, are not independent
of each other under a wrong key: what resembles a candidate in one may resemble it in the other. Their weights are added
up before the mean over the key is taken, so that each says what it can and nothing counts twice. Waveforms that only
one recording shows, as each slot of a rolling schedule has its own, multiply.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import log_softmax, logsumexp

from mtm_audit.model.track import Floats
from mtm_audit.significance.channel_terms import or_silent
from mtm_audit.significance.likelihood import Hypotheses, log_e_of
from mtm_audit.significance.message_evidence import MessageEvidence
from mtm_audit.significance.sequence import weights_of
from mtm_audit.significance.symbol_evidence import OTHERS, SymbolEvidence, learned_weights
from mtm_audit.significance.weighed_channel import TableOf, WeighedChannel, largest, selected

Integers = NDArray[np.int64]

# So many combinations of the recordings' hypotheses are weighed, and candidates of each recording tried.
_COMBINATIONS = 64
_TRIED = 2


@dataclass(frozen=True, kw_only=True)
class Witness:
    """What one recording shows of a channel, on `axes`: `positions` (groups,) the message's position of each group of
    windows and `waveforms` (groups,) the number of the waveform it plays, both counted alike in all recordings.
    """

    item: WeighedChannel
    axes: tuple[str, ...]
    positions: Integers
    waveforms: Integers

    def groups_at(self, position: int) -> Integers:
        """The groups that carry a position."""
        return np.flatnonzero(self.positions == position)

    def row_of(self, group: int) -> int:
        """The group's row of candidates."""
        channel = self.item.channel
        return channel.shown.index(int(channel.positions[group]))

    def column_of(self, group: int, symbol: int) -> int | None:
        """Where the group's candidates have a symbol."""
        found = np.flatnonzero(self.item.channel.candidates[self.row_of(group)] == symbol)
        return int(found[0]) if len(found) else None


@dataclass(frozen=True)
class _Weighted:
    """Hypotheses of one witness: `log_shares` (hypotheses,) and the weights of its groups, (hypotheses, groups, axes,
    2 K) each.
    """

    log_shares: Floats
    linear: Floats
    quadratic: Floats


def weigh_together(
    evidence: Sequence[MessageEvidence], channels: Mapping[str, Sequence[Witness]], positions: Iterable[int]
) -> MessageEvidence:
    """What recordings say together: `evidence` of each, and by channel name what each shows of it.

    Each recording alone, and all of them together, are equally probable. `positions` are those of the message, whose
    symbols are weighed; none for a framed one.
    """
    odds = np.log(1.0 + len(evidence))
    nats = {name: _channel_nats(witnesses) for name, witnesses in channels.items()}
    joint = float(np.sum(np.logaddexp(list(nats.values()), 0.0) - np.log(2.0)))
    presence = float(logsumexp([joint, *(each.presence_nats for each in evidence)]) - odds)
    by_name = {
        name: float(logsumexp([value, *(each.channels_nats.get(name, -np.inf) for each in evidence)]) - odds)
        for name, value in nats.items()
    }
    symbols = tuple(_best_symbol(evidence, channels, position) for position in positions)
    return MessageEvidence(presence, by_name, symbols)


def _best_symbol(
    evidence: Sequence[MessageEvidence], channels: Mapping[str, Sequence[Witness]], position: int
) -> SymbolEvidence | None:
    showing = [
        shown
        for witnesses in channels.values()
        if (shown := [witness for witness in witnesses if len(witness.groups_at(position))])
    ]
    if not showing:
        return None
    own = [each.symbols[position] for each in evidence if position < len(each.symbols)]
    found = []
    for symbol in _tried(showing, position):
        joint = sum(_symbol_nats(witnesses, position, symbol) for witnesses in showing)
        alone = [item.nats for item in own if item is not None and item.symbol == symbol]
        found.append(SymbolEvidence(symbol, float(logsumexp([joint, *alone]) - np.log(1.0 + len(evidence)))))
    return max(found, key=lambda item: item.nats)


def _tried(showing: Sequence[Sequence[Witness]], position: int) -> list[int]:
    """The symbols that some recording finds most likely."""
    symbols: list[int] = []
    for witnesses in showing:
        for witness in witnesses:
            row = witness.row_of(int(witness.groups_at(position)[0]))
            symbols += witness.item.channel.candidates[row][:_TRIED].tolist()
    return list(dict.fromkeys(symbols))


def _channel_nats(witnesses: Sequence[Witness]) -> float:
    """Log e-value of the likeliest message on one channel, position by position."""
    shown = sorted({int(place) for witness in witnesses for place in witness.positions})
    weighted = [_under_prior(witness, _each(len(witnesses))) for witness in witnesses]
    total = _combined([each.log_shares for each in weighted])
    shared, size = witnesses[0].item.channel.shared, witnesses[0].item.channel.alphabet_size
    said: set[int] = set()
    for position in shown:
        holding = [(row, one) for row, one in enumerate(witnesses) if len(one.groups_at(position))]
        tried = _tried([[one for _, one in holding]], position)
        tables = [_joint_log_e(witnesses, weighted, position, symbol) for symbol in tried]
        best = int(np.argmax([logsumexp(total + table) for table in tables]))
        # Under the fixed schedule a symbol that comes again has no fresh waveform.
        told = np.zeros_like(total) if shared and tried[best] in said else tables[best]
        said.add(tried[best])
        total = total + or_silent(told - np.log(size))
    return float(logsumexp(total)) + sum(witness.item.cost for witness in witnesses)


def _symbol_nats(witnesses: Sequence[Witness], position: int, symbol: int) -> float:
    """Log e-value of one candidate on one channel, by the prior and by what other positions say of hypotheses."""
    count = _each(len(witnesses))
    by_prior = _mixture(witnesses, [_under_prior(one, count) for one in witnesses], position, symbol)
    others = [_under_others(one, count, position, symbol) for one in witnesses]
    plain = _mixture(witnesses, [plain for plain, _ in others], position, symbol)
    learned = _mixture(witnesses, [learned for _, learned in others], position, symbol)
    by_others = np.logaddexp(plain, learned) - np.log(2.0)
    cost = sum(witness.item.cost for witness in witnesses)
    return float(np.logaddexp(by_others + np.log(OTHERS), by_prior + np.log(1.0 - OTHERS))) + cost


def _mixture(witnesses: Sequence[Witness], weighted: Sequence[_Weighted], position: int, symbol: int) -> float:
    shares = _combined([each.log_shares for each in weighted])
    return float(logsumexp(_joint_log_e(witnesses, weighted, position, symbol) + shares))


def _each(witnesses: int) -> int:
    """How many hypotheses of each recording are combined with those of the others."""
    return max(2, int(_COMBINATIONS ** (1.0 / witnesses) + 0.5))


def _under_prior(witness: Witness, count: int) -> _Weighted:
    """The hypotheses that say most of the whole channel, at their prior probability."""
    item = witness.item
    chosen, log_priors = item.chosen
    said = log_priors + item.channel.mixed(item.exact).sum(axis=-1)
    places = largest(said, count)
    return _Weighted(log_priors[places], *weights_of(item.terms, _some(chosen, places)))


def _under_others(witness: Witness, count: int, position: int, symbol: int) -> tuple[_Weighted, _Weighted]:
    """The hypotheses of which the other positions say most, as they stand and with what those show of each tone.

    The candidate's own waveform has no part in the choice but for the timing, whose weight is paid.
    """
    item = witness.item
    channel = item.channel
    groups = witness.groups_at(position)
    if not len(groups) or len(channel.shown) == 1:
        plain = _under_prior(witness, count)
        return plain, plain
    row = witness.row_of(int(groups[0]))
    timing, log_weight = channel.centred()
    terms = channel.at(timing)

    def said(table_of: TableOf) -> Floats:
        values = channel.mixed(table_of(terms), symbol if channel.shared else None)
        return np.asarray(np.delete(values, row, axis=-1).sum(axis=-1))

    pairs, places, log_weights = selected(terms, terms.log_priors, said)
    shares = np.asarray(log_softmax(log_weights)) + log_weight
    kept = largest(shares, count)
    chosen = terms.hypotheses(pairs, places[kept])
    linear, quadratic = weights_of(terms, chosen)
    plain = _Weighted(shares[kept], linear, quadratic)
    column = witness.column_of(int(groups[0]), symbol)
    if column is None:
        return plain, plain
    table = channel.by_position(terms.exact(chosen)) + shares[kept][:, None, None]
    better = learned_weights(channel, linear, quadratic, table, (row, column))
    linear, quadratic = linear.copy(), quadratic.copy()
    linear[:, groups], quadratic[:, groups] = better
    return plain, _Weighted(shares[kept], linear, quadratic)


def _some(chosen: Hypotheses, places: Integers) -> Hypotheses:
    return Hypotheses(chosen.timings[places], chosen.plants[places], chosen.levels[places], chosen.turns[places])


def _combined(shares: Sequence[Floats]) -> Floats:
    """Sums over all combinations, (combinations,), the last recording's hypotheses fastest."""
    total: Floats = np.zeros(1)
    for each in shares:
        total = (total[:, None] + each).ravel()
    return total


def _joint_log_e(witnesses: Sequence[Witness], weighted: Sequence[_Weighted], position: int, symbol: int) -> Floats:
    """Log e-values (combinations,) of a symbol at a position; recordings that play one waveform are added up first."""
    shape = tuple(len(each.log_shares) for each in weighted)
    played: dict[tuple[tuple[str, ...], int], list[tuple[int, int]]] = {}
    for row, witness in enumerate(witnesses):
        for group in witness.groups_at(position).tolist():
            played.setdefault((witness.axes, int(witness.waveforms[group])), []).append((row, group))
    total: Floats = np.zeros(shape)
    for places in played.values():
        tones = next((found for row, group in places
                      if (found := _tones(witnesses[row], group, symbol)) is not None), None)  # fmt: skip
        if tones is None:
            continue
        linear: Floats = np.zeros((*shape, *tones.shape))
        quadratic: Floats = np.zeros((*shape, *tones.shape))
        for row, group in places:
            along = [1] * len(shape)
            along[row] = shape[row]
            linear = linear + weighted[row].linear[:, group].reshape(*along, *tones.shape)
            quadratic = quadratic + weighted[row].quadratic[:, group].reshape(*along, *tones.shape)
        flat = (int(np.prod(shape)), 1, *tones.shape)
        law = witnesses[places[0][0]].item.channel.law
        found = log_e_of(linear.reshape(flat), quadratic.reshape(flat), tones[None, None], law)
        total = total + found.reshape(shape)
    return np.asarray(total.ravel())


def _tones(witness: Witness, group: int, symbol: int) -> Floats | None:
    """The waveform of a symbol, (injected axes, 2 K), where the group's candidates have it."""
    column = witness.column_of(group, symbol)
    return None if column is None else np.asarray(witness.item.channel.tones[group, column])
