"""One channel by itself: the hypotheses that say most under the prior, and what they say."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from mtm_audit.model.timing import Timing
from mtm_audit.model.track import Floats
from mtm_audit.significance.channel_terms import ChannelTerms, Terms
from mtm_audit.significance.gains import all_levels
from mtm_audit.significance.likelihood import Hypotheses
from mtm_audit.significance.neighbourhood import at_phase_of

Integers = NDArray[np.int64]
# Takes one of a channel's tables, by shown position, out of its terms; and what channels say by such tables.
TableOf = Callable[[Terms], Floats]
Said = Callable[[TableOf], Floats]

_PAIRS = 8
_HYPOTHESES = 48


@dataclass(frozen=True)
class WeighedChannel:
    """A channel at its own timing, whose prior is paid for; `cost` is the log prior of its track."""

    channel: ChannelTerms
    terms: Terms
    cost: float

    @cached_property
    def chosen(self) -> tuple[Hypotheses, Floats]:
        """The hypotheses that say most under the prior, and their log priors."""
        channel, terms = self.channel, self.terms
        priors = terms.log_priors
        pairs, places, _ = selected(terms, priors, lambda table_of: channel.mixed(table_of(terms)).sum(axis=-1))
        return terms.hypotheses(pairs, places), log_prior(channel, priors[pairs]).ravel()[places]

    @cached_property
    def nats(self) -> float:
        """Log e-value of any message on this channel."""
        chosen, log_priors = self.chosen
        return float(logsumexp(self.terms.exact_presence(chosen) + log_priors)) + self.cost

    @cached_property
    def by_group(self) -> Floats:
        """Exact log e-values under the chosen hypotheses, (hypotheses, groups, k)."""
        return self.terms.exact(self.chosen[0])

    @cached_property
    def exact(self) -> Floats:
        """The same by position, (hypotheses, shown positions, k)."""
        return self.channel.by_position(self.by_group)


def weighed(channel: ChannelTerms, cost: float) -> WeighedChannel:
    """The channel at the timing that was found for it."""
    return WeighedChannel(channel, channel.at(channel.timing), cost)


def log_prior(channel: ChannelTerms, log_pairs: Floats) -> Floats:
    """Log priors (pairs, levels, orientations) of pairs whose own are `log_pairs` (pairs,)."""
    levels = all_levels().log_priors[:, None] - np.log(len(channel.turns))
    cameras = np.broadcast_to(levels, (len(levels), len(channel.turns)))
    return np.asarray(log_pairs[:, None, None] + cameras)


def selected(terms: Terms, log_pairs: Floats, said: Said) -> tuple[Integers, Integers, Floats]:
    """The hypotheses of which most is said, prior included: pairs, places in their fine table, log weights of these.

    `log_pairs` (pairs,) are the priors of pairs of a timing and a plant.
    """
    pairs = largest(logsumexp(said(lambda table: table.coarse), axis=(1, 2)) + log_pairs, _PAIRS)
    fine = (said(lambda table: table.fine(pairs)) + log_prior(terms.channel, log_pairs[pairs])).ravel()
    places = largest(fine, _HYPOTHESES)
    return pairs, places, fine[places]


def largest(values: Floats, count: int) -> Integers:
    """Places of the largest values, any order."""
    count = min(count, len(values))
    return np.argpartition(-values, count - 1)[:count]


def best_pairs(values: Floats) -> Integers:
    """As many of the pairs with the largest values as are looked at closely."""
    return largest(values, _PAIRS)


def best_hypotheses(values: Floats) -> Integers:
    """As many of the hypotheses with the largest values as are weighed exactly."""
    return largest(values, _HYPOTHESES)


def anchor(channels: Sequence[ChannelTerms], channel: ChannelTerms) -> Timing:
    """The timing of the channel in `channels` that shows most, as `channel` counts its windows.

    What that channel found by itself: a timing that `channel` had a say in would depend on its candidates.
    """
    strongest = max(channels, key=lambda other: other.strength)
    return at_phase_of(channel.timing, strongest.alone, channel.span.window_ticks)


def alike(channels: Sequence[ChannelTerms]) -> bool:
    """Whether hypotheses can be shared: one table's shape and one kind of motion for all."""
    return len({(channel.turns.shape, channel.span.step_s) for channel in channels}) == 1
