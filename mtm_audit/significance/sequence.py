"""The e-value of one whole message, read position by position, each with what the ones before have shown.

A message is one term of the mixture over all messages, with prior probability 1 / M for each position. Its positions'
waveforms are drawn one after the other, so that a position may be weighed with responses and interference that earlier
ones have shown (`adaptation`). A symbol that comes again under the fixed schedule has no new waveform and adds nothing.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from mtm_audit.model.track import Floats
from mtm_audit.significance.adaptation import adapted, seen_of
from mtm_audit.significance.channel_terms import ChannelTerms, Terms, or_silent
from mtm_audit.significance.gains import all_levels
from mtm_audit.significance.likelihood import Hypotheses, log_e_of, weights
from mtm_audit.significance.neighbourhood import RATES
from mtm_audit.significance.weighed_channel import TableOf, WeighedChannel, log_prior, selected

Integers = NDArray[np.int64]


@dataclass(frozen=True)
class Sequence:
    """`columns` (shown positions,): the candidate at each position; `nats`: the message's log e-value, prior and costs
    included; `log_timings` (timings,): log probabilities of the timings once it is read.
    """

    columns: Integers
    nats: float
    log_timings: Floats


def likeliest(table: Floats, log_weights: Floats) -> Integers:
    """The candidate of each position, (positions,), in a table of log e-values (hypotheses, positions, k)."""
    return np.asarray(np.argmax(logsumexp(table + log_weights[:, None, None], axis=0), axis=1))


def sequences(item: WeighedChannel) -> list[Sequence]:
    """The messages that are likeliest, by this channel alone and by all that was read together: different ones."""
    channel = item.channel
    chosen, log_priors = item.chosen
    alone = likeliest(item.exact, log_priors + channel.mixed(item.exact).sum(axis=-1))
    # Candidates stand in the order of what all parts of a channel say together.
    messages = [alone] if not alone.any() else [alone, np.zeros_like(alone)]
    found = []
    for columns in messages:
        told = _told(channel, item.terms, chosen, item.by_group, columns)
        total = or_silent(told - np.log(channel.alphabet_size)).sum(axis=1) + log_priors
        found.append(Sequence(columns, float(logsumexp(total)) + item.cost, _log_timings(item.terms, chosen, total)))
    return found


def continued(first: Sequence, channel: ChannelTerms, terms: Terms) -> float:
    """Log e-value of the same message in another part of the channel, given what the first part has shown.

    Its timing is the first part's or, since plants differ, any other at the same rate, at even odds; the symbols are
    paid for.
    """
    log_pairs = _delayed(first.log_timings)[terms.timings] - np.log(terms.plants.max() + 1)
    rows = np.arange(len(first.columns))

    def said(table_of: TableOf) -> Floats:
        table = table_of(terms)
        return np.asarray(or_silent(table[..., rows, first.columns]).sum(axis=-1))

    pairs, places, _ = selected(terms, log_pairs, said)
    chosen = terms.hypotheses(pairs, places)
    told = _told(channel, terms, chosen, terms.exact(chosen), first.columns)
    priors = log_prior(channel, log_pairs[pairs]).ravel()[places]
    return float(logsumexp(or_silent(told).sum(axis=1) + priors))


def _told(channel: ChannelTerms, terms: Terms, chosen: Hypotheses, by_group: Floats, columns: Integers) -> Floats:
    """Log e-values (hypotheses, shown positions) of a message, each position learning from those before or not."""
    shown = np.array(channel.shown)
    rows = np.searchsorted(shown, channel.positions)
    carried = columns[rows]
    groups = np.arange(len(rows))
    fresh = _fresh(channel, columns)[rows]
    plain = by_group[:, groups, carried]
    used = (rows[None, :] < rows[:, None]) & fresh[None, :]
    sent = channel.tones[groups, carried]
    linear, quadratic = adapted(seen_of(*weights_of(terms, chosen)), sent, used, groups)
    learned = log_e_of(linear, quadratic, sent[:, None], channel.law)[..., 0]
    by_position = np.stack(
        [
            np.logaddexp(plain[:, rows == row].sum(axis=1), learned[:, rows == row].sum(axis=1)) - np.log(2.0)
            for row in range(len(shown))
        ],
        axis=1,
    )
    return np.where(_fresh(channel, columns), by_position, 0.0)


def weights_of(terms: Terms, chosen: Hypotheses) -> tuple[Floats, Floats]:
    """The weights of each group under the hypotheses, see `likelihood.weights`."""
    return weights(terms.projections, all_levels(), terms.channel.turns, chosen)


def _fresh(channel: ChannelTerms, columns: Integers) -> NDArray[np.bool_]:
    """Which positions' symbols have a waveform that no earlier position has, (shown positions,)."""
    if not channel.shared:
        return np.ones(len(columns), dtype=np.bool_)
    symbols = channel.candidates[np.arange(len(columns)), columns]
    first = np.unique(symbols, return_index=True)[1]
    return np.isin(np.arange(len(columns)), first)


def _log_timings(terms: Terms, chosen: Hypotheses, total: Floats) -> Floats:
    """Log probabilities (timings,) of the timings of the hypotheses."""
    result = np.full(int(terms.timings.max()) + 1, -np.inf)
    np.logaddexp.at(result, chosen.timings, total - logsumexp(total))
    return result


def _delayed(log_timings: Floats) -> Floats:
    """Half of the probability on each timing itself, half spread over all shifts at its rate, (timings,)."""
    by_shift = log_timings.reshape(-1, RATES)
    spread = logsumexp(by_shift, axis=0) - np.log(len(by_shift))
    return np.asarray((np.logaddexp(by_shift, spread) - np.log(2.0)).ravel())
