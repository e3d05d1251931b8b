"""One channel's candidates and motion, and the tables of log e-values that mixtures are made of."""

from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from scipy.special import logsumexp

from mtm_audit.detectors.base import ChannelReading
from mtm_audit.detectors.matched.candidates import stacked_tones
from mtm_audit.detectors.matched.correlate import Prepared
from mtm_audit.detectors.matched.evidence import log_sum_exp
from mtm_audit.detectors.matched.plants import Plants, joined, plant_family, returning, second_order
from mtm_audit.detectors.matched.projections import Places, Projections, project, shaped
from mtm_audit.model.timing import Onset, OnsetRange, Timing
from mtm_audit.model.track import Floats
from mtm_audit.significance.gains import Levels, all_levels, orientations
from mtm_audit.significance.likelihood import Hypotheses, approximate_log_e, log_e, log_e_of, weights
from mtm_audit.significance.neighbourhood import Neighbourhood, Span, centred, neighbourhood
from mtm_audit.significance.other_positions import OtherPositions
from mtm_onboard.protocol.codebook import Codebook
from mtm_onboard.protocol.scheme import Channel, Power

Integers = NDArray[np.int64]

# Shapes of the response once the delay, which is searched as a shift of the timing, is taken off.
SHAPES: Plants = joined(
    plant_family(np.array([0.0]), np.array([0.04, 0.1, 0.2, 0.4])),
    returning(plant_family(np.array([0.0]), np.array([0.06, 0.2])), (0.1, 0.3)),
    second_order((1.3, 2.2, 3.5), 0.7),
)
# To choose timings and plants every fourth loudness will do, 12 dB apart.
_COARSE = slice(1, None, 4)
_COARSE_LEVELS = 3
_CANDIDATES = 8
# Prior probability that a position carries nothing: hidden, beyond the message's end, or not played.
_SILENT = 0.1


@dataclass(frozen=True, kw_only=True)
class ChannelTerms:
    """What evidence needs of one channel.

    `groups` (windows,) numbers the windows that are played from one waveform, `positions` (groups,) says which message
    position each carries. `candidates` (shown positions, k) are the symbols that are looked at, those that score best;
    `tones` (groups, k, injected axes, 2 K) theirs, without the spectrum's `powers` (K,): these count as part of the
    response, so that tones follow the law whose mean is known in closed form. `shared` when one codebook serves all
    positions (fixed schedule). `timing` is what all channels together found; `alone` and `strength` are what this one
    found by itself. Channels of one `name` are parts of one, which carry the same symbols on different axes. `others`
    is there where other positions may say when a position's windows began.
    """

    name: str
    prepared: Prepared
    span: Span
    timing: Timing
    onset: Onset
    groups: Integers
    positions: Integers
    candidates: Integers
    tones: Floats
    tones_hz: Floats
    powers: Floats
    law: Power
    alphabet_size: int
    shared: bool
    strength: float
    alone: Timing
    others: OtherPositions | None = None
    _terms: dict[bytes, "Terms"] = field(default_factory=dict, repr=False, compare=False)

    @property
    def shown(self) -> list[int]:
        """The message positions that some window carries, ascending; rows of `candidates`."""
        return sorted(set(self.positions.tolist()))

    @property
    def turns(self) -> Floats:
        """Orientations of the camera, (orientations, observed axes, injected axes)."""
        return orientations(len(self.prepared.filtered), self.tones.shape[2])

    def at(self, timing: Timing) -> "Terms":
        """The tables around a timing; kept, since several mixtures ask for the same, and timings that differ by less
        than the grid have one neighbourhood.
        """
        near = neighbourhood(self.span, timing, self.onset)
        place = near.starts_s.tobytes()
        if place not in self._terms:
            self._terms[place] = _terms_at(self, timing, near)
        return self._terms[place]

    def centred(self) -> tuple[Timing, float]:
        """The timing that was found, moved to one at which a term may be weighed, and the log weight that it costs."""
        return centred(self.span, self.timing, self.onset)

    def by_position(self, table: Floats) -> Floats:
        """Add up the groups of each shown position: (..., groups, k) to (..., shown positions, k)."""
        if len(self.shown) == len(self.positions) and np.array_equal(self.positions, self.shown):
            return table
        return np.stack([table[..., self.positions == place, :].sum(axis=-2) for place in self.shown], axis=-2)

    def mixed(self, table: Floats, without: int | None = None) -> Floats:
        """Log mean over all symbols of e-values (..., shown positions, k), or nothing sent: (..., shown positions).

        Symbols not looked at, and the symbol `without`, count nothing.
        """
        if without is not None:
            table = np.where(self.candidates == without, -np.inf, table)
        return or_silent(log_sum_exp(table, axis=-1) - np.log(self.alphabet_size))


def or_silent(log_values: Floats, count: int = 1) -> Floats:
    """Log mean of e-values of `count` positions and of 1, which is what positions without a waveform would give."""
    return np.asarray(np.logaddexp(log_values + count * np.log(1.0 - _SILENT), count * np.log(_SILENT)))


@dataclass(frozen=True)
class Terms:
    """Tables of one channel around one timing.

    Pairs of a timing and a plant, `timings` and `plants` (pairs,) with `log_priors` (pairs,), the camera's and the
    loudness' apart; `coarse` (pairs, coarse levels, orientations, shown positions, k) approximate log e-values.
    """

    channel: ChannelTerms
    projections: Projections
    timings: Integers
    plants: Integers
    log_priors: Floats
    coarse: Floats
    _fine: dict[int, Floats] = field(default_factory=dict, repr=False, compare=False)

    def fine(self, pairs: Integers) -> Floats:
        """Approximate log e-values of some pairs: (pairs, levels, orientations, shown positions, k)."""
        for pair in pairs:
            if int(pair) not in self._fine:
                at = np.array([pair])
                self._fine[int(pair)] = approximate_log_e(
                    self.projections, self.channel.tones, all_levels(), self.channel.turns,
                    self.timings[at], self.plants[at], self.channel.by_position,
                )[0]  # fmt: skip
        return np.stack([self._fine[int(pair)] for pair in pairs])

    def hypotheses(self, pairs: Integers, places: Integers) -> Hypotheses:
        """Those at flat `places` of a table (pairs, levels, orientations)."""
        pair, level, turn = np.unravel_index(
            places, (len(pairs), len(all_levels().magnitudes), len(self.channel.turns))
        )
        return Hypotheses(self.timings[pairs[pair]], self.plants[pairs[pair]], level, turn)

    def exact(self, chosen: Hypotheses) -> Floats:
        """Exact log e-values (hypotheses, groups, k)."""
        channel = self.channel
        return log_e(self.projections, channel.tones, all_levels(), channel.turns, chosen, channel.law)

    def exact_presence(self, chosen: Hypotheses) -> Floats:
        """Exact log e-values of any message, (hypotheses,).

        Where positions share a codebook, candidates count for the position where they score best alone, so that no
        waveform enters twice; a symbol that is best at several positions is weighed over all of them together.
        """
        channel = self.channel
        table = self.exact(chosen)
        if not channel.shared or len(channel.shown) == 1:
            return np.asarray(channel.mixed(channel.by_position(table)).sum(axis=-1))
        best = table.max(axis=0)
        symbols = channel.candidates[np.arange(len(best)), np.argmax(best, axis=1)]
        linear, quadratic = weights(self.projections, all_levels(), channel.turns, chosen)
        total = np.zeros(len(table))
        for symbol in np.unique(symbols):
            places = np.flatnonzero(symbols == symbol)
            column = int(np.flatnonzero(channel.candidates[places[0]] == symbol)[0])
            if len(places) > 1:
                tones = channel.tones[places[:1], column : column + 1]
                joint = log_e_of(linear[:, places].sum(1, keepdims=True), quadratic[:, places].sum(1, keepdims=True),
                                 tones, channel.law)  # fmt: skip
                total += or_silent(joint[:, 0, 0] - len(places) * np.log(channel.alphabet_size), len(places))
                continue
            mine = self._claimed(best, int(places[0]), symbols)
            own = logsumexp(np.where(mine, table[:, places[0]], -np.inf), axis=-1)
            total += or_silent(own - np.log(channel.alphabet_size))
        return total

    def _claimed(self, best: Floats, place: int, symbols: Integers) -> NDArray[np.bool_]:
        """Which candidates of a place count there: its best one, and those that no other place looks at."""
        candidates = self.channel.candidates
        others = np.delete(candidates, place, axis=0)
        return np.asarray(~np.isin(candidates[place], others) | (candidates[place] == symbols[place]))


def channel_terms(
    codebook: Codebook, channel: Channel, reading: ChannelReading, onset: Onset, *, apart: bool
) -> ChannelTerms:
    """A channel's terms from what a detector read, which must hold the prepared motion.

    With `apart` every window carries a position of its own, as in a recording of several framed messages.
    """
    if reading.prepared is None:
        raise ValueError("only the matched detector prepares motions for evidence")
    scheme, found = codebook.scheme, reading.reading
    shared = scheme.schedule == "fixed"
    windows = np.arange(len(found.window_numbers))
    carried = windows if apart else found.window_positions
    scores = found.window_scores if apart else found.scores
    shown, rows = np.unique(carried, return_inverse=True)
    candidates = np.argsort(-scores[shown], axis=1, kind="stable")[:, :_CANDIDATES]
    groups, positions = (rows, shown) if shared else (windows, carried)
    played = np.zeros(len(positions), dtype=np.int64) if shared else found.window_numbers
    tones = [
        stacked_tones(codebook, channel, int(number), candidates[row].tolist())
        for number, row in zip(played, np.arange(len(shown)) if shared else rows, strict=True)
    ]
    ticks, powers = scheme.window_ticks(channel), codebook.tone_powers(channel)
    return ChannelTerms(
        name=channel.name,
        prepared=reading.prepared,
        span=Span(
            numbers=found.window_numbers,
            window_ticks=ticks,
            step_s=reading.prepared.motion.step_s,
            origin_s=reading.prepared.motion.start_s,
            lasts_s=len(reading.prepared.motion.seen) * reading.prepared.motion.step_s,
            nominal_hz=scheme.rate_hz,
            order=channel.symbols if shared else 1,
        ),
        timing=found.timing,
        onset=onset,
        groups=groups,
        positions=positions + (0 if apart else scheme.first_position(channel)),
        candidates=candidates,
        tones=np.stack(tones).astype(np.float64) / np.sqrt(np.concatenate([powers, powers])),
        tones_hz=codebook.bins(channel) * (found.timing.rate_hz / ticks),
        powers=powers,
        law=scheme.power,
        alphabet_size=scheme.alphabet_size,
        shared=shared,
        strength=found.strength if reading.alone_strength is None else reading.alone_strength,
        alone=found.timing if reading.alone is None else reading.alone,
        others=None if apart else _others(codebook, channel, reading.prepared, onset),
    )


def _others(codebook: Codebook, channel: Channel, prepared: Prepared, onset: Onset) -> OtherPositions | None:
    """Where each window has its own waveform and the search for the start has to be paid."""
    if codebook.scheme.schedule == "rolling" and isinstance(onset, OnsetRange) and channel.symbols > 1:
        return OtherPositions(codebook, channel, prepared, onset)
    return None


def _terms_at(channel: ChannelTerms, timing: Timing, near: Neighbourhood) -> Terms:
    length_s = channel.span.window_ticks / timing.rate_hz
    places = Places(near.starts_s, channel.groups, SHAPES, length_s, channel.tones_hz)
    projections = shaped(project(channel.prepared, places), channel.powers)
    timings, plants = (
        grid.ravel()
        for grid in np.meshgrid(np.arange(len(near.log_priors)), np.arange(len(SHAPES.taps)), indexing="ij")
    )
    log_priors = near.log_priors[timings] - np.log(len(SHAPES.taps))
    # The largest of all tables chooses pairs and weighs nothing: single precision will do.
    coarse = approximate_log_e(
        projections, channel.tones, coarse_levels(), channel.turns, timings, plants, channel.by_position, np.float32
    )
    return Terms(channel, projections, timings, plants, log_priors, coarse)


def coarse_levels() -> Levels:
    """The few loudness levels that choose timings and plants, equally probable."""
    levels = all_levels()
    return Levels(levels.magnitudes[_COARSE][:_COARSE_LEVELS], levels.reliefs[_COARSE][:_COARSE_LEVELS],
                  np.full(_COARSE_LEVELS, -np.log(_COARSE_LEVELS)))  # fmt: skip
