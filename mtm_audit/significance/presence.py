"""Presence: the e-value of any message, over hypotheses, channels and messages.

Channels share a hypothesis, or have each its own, or say nothing, at a third each.
"""

from collections.abc import Sequence

import numpy as np
from scipy.special import logsumexp

from mtm_audit.model.track import Floats
from mtm_audit.significance.sequence import continued, sequences
from mtm_audit.significance.weighed_channel import (
    WeighedChannel,
    alike,
    anchor,
    best_hypotheses,
    best_pairs,
    log_prior,
)


def channel_nats(parts: Sequence[WeighedChannel]) -> float:
    """Log e-value of any message on one channel, which is read in `parts`.

    Any message in one of the parts, or one of the likeliest in all of them, position by position; all equally probable.
    """
    found = [part.nats for part in parts]
    if len(parts[0].channel.shown) > 1 or len(parts) > 1:
        orders = [(part, [*parts[:row], *parts[row + 1 :]]) for row, part in enumerate(parts)]
        found.append(float(logsumexp([_in_order(*order) for order in orders]) - np.log(len(orders))))
    return float(logsumexp(found) - np.log(len(found)))


def _in_order(first: WeighedChannel, others: Sequence[WeighedChannel]) -> float:
    """Log e-value of any message in all parts, one after the other; those that are likeliest are looked at."""
    found = []
    for message in sequences(first):
        after = [continued(message, part.channel, part.channel.at(first.channel.timing)) for part in others]
        found.append(message.nats + sum(after))
    return float(logsumexp(found))


def presence(channels: Sequence[Sequence[WeighedChannel]], nats: Sequence[float]) -> float:
    """Log e-value of any message on the channels, each in its parts; `nats` what each says by itself."""
    if len(channels) == 1:
        return nats[0]
    alone = float(np.sum(np.logaddexp(nats, 0.0) - np.log(2.0)))
    said = [alone, *(_shared(kind) for kind in _kinds(channels, nats))]
    return float(logsumexp(said) - np.log(len(said)))


def _kinds(
    channels: Sequence[Sequence[WeighedChannel]], nats: Sequence[float]
) -> list[list[tuple[WeighedChannel, float]]]:
    """Parts that can share a hypothesis, each with what its channel says by itself; no part is alone."""
    kinds: list[list[tuple[WeighedChannel, float]]] = []
    for parts, own in zip(channels, nats, strict=True):
        for part in parts:
            mine = next((kind for kind in kinds if alike([kind[0][0].channel, part.channel])), None)
            if mine is None:
                kinds.append([(part, own)])
            else:
                mine.append((part, own))
    return [kind for kind in kinds if len(kind) > 1]


def _shared(kind: Sequence[tuple[WeighedChannel, float]]) -> float:
    """Log e-value of all under one hypothesis, each of which may have its own instead, or say nothing."""
    channels = [item.channel for item, _ in kind]
    tables = [channel.at(anchor(channels, channel)) for channel in channels]

    def together(values: Sequence[Floats]) -> Floats:
        blurred = [_blurred(value + item.cost, own) for value, (item, own) in zip(values, kind, strict=True)]
        return np.asarray(np.sum(blurred, axis=0))

    coarse = [logsumexp(channel.mixed(terms.coarse).sum(axis=-1), axis=(1, 2)) - np.log(terms.coarse[0, ..., 0, 0].size)
              for channel, terms in zip(channels, tables, strict=True)]  # fmt: skip
    first = tables[0]
    pairs = best_pairs(together(coarse) + first.log_priors)
    priors = log_prior(first.channel, first.log_priors[pairs])
    fine = together([channel.mixed(terms.fine(pairs)).sum(axis=-1)
                     for channel, terms in zip(channels, tables, strict=True)]) + priors  # fmt: skip
    places = best_hypotheses(fine.ravel())
    exact = together([terms.exact_presence(terms.hypotheses(pairs, places)) for terms in tables])
    return float(logsumexp(exact + priors.ravel()[places]))


def _blurred(shared: Floats, own: float) -> Floats:
    """Log of the mean of the shared e-values, the channel's own one, and 1."""
    return np.asarray(np.logaddexp(np.logaddexp(shared, own), 0.0) - np.log(3.0))
