"""Symbols and plant, estimated together from a broad prior on.

Each window's symbol is judged under what all other windows say about the plant, never under what itself says, so
that a wrong decision does not confirm itself. Windows of other observations (other robots of a fleet, filmed by the
same camera) count as one hypothesis beside the one that they are strangers, and so does that all observed axes answer
alike (a robot on wheels, seen from anywhere) beside the one that each has a plant of its own (a lander's engines).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.special import log_softmax, softmax

from mtm_audit.detectors.matched.candidates import WHOLE
from mtm_audit.detectors.matched.evidence import GAIN_VARIANCE, half_log_evidence, log_sum_exp
from mtm_audit.detectors.matched.first_pass import KEPT, first_pass
from mtm_audit.detectors.matched.motion import Motion
from mtm_audit.detectors.matched.noise import NoiseModel, fit_noise_by_axis, model_order, whitened_from_silence
from mtm_audit.detectors.matched.outliers import outlier_correction
from mtm_audit.detectors.matched.plants import COARSE, FINE
from mtm_audit.detectors.matched.profile import PlantProfile, log_prior
from mtm_audit.detectors.matched.windows import (
    Statistics,
    Window,
    pulled_by,
    response_rows,
    statistics,
)
from mtm_audit.model.track import Floats

_ROUNDS = 3


@dataclass
class _Judged:
    """The running state of one window: its kept candidates and what is believed of them."""

    window: Window
    kept: np.ndarray
    tones: Floats  # (L, A, 2 K) of the kept candidates
    rows: Floats
    ratios: Floats  # (L,) log-likelihood ratios of the kept candidates, nats
    # (M,) log-likelihood ratios of all candidates, roughly: under the prior, then under one plant. Those of a large
    # alphabet are in single precision, in which they are weighed.
    overview: Floats
    belief: Floats  # (L,) probabilities of the kept candidates, all repeats taken together
    by_plant: Floats  # (L, plants) log-likelihood ratios of the kept candidates under each plant of all axes alike
    signal: Floats  # (observed axes, n) expected contribution to the motion
    elsewhere: Floats  # (M,) log-likelihood ratios of all candidates by what is not in this motion


def fit_recording_noise(motions: Sequence[Motion], signals: Sequence[Floats]) -> NoiseModel:
    """The noise model of what `signals` hold, with orders that so many samples carry."""
    samples = sum(signal.size for signal in signals)
    return fit_noise_by_axis(signals, [motion.seen for motion in motions], model_order(samples))


@dataclass(frozen=True)
class Estimate:
    """`ratios` (windows, M): log-likelihood ratios in nats, this waveform against none; `signals`: what each window
    is expected to add to the motion, (observed axes, n); `residuals`: each observation's motion less all of them;
    `noise`: the interference as it is known in the end; `plants`: probabilities of the plants of `FINE`, as all windows
    together show them when all robots share one.
    """

    ratios: Floats
    signals: tuple[Floats, ...]
    residuals: tuple[Floats, ...]
    noise: NoiseModel
    plants: Floats


def estimate(
    windows: Sequence[Window],
    motions: Sequence[Motion],
    noise: NoiseModel,
    profile: PlantProfile | None = None,
    elsewhere: Sequence[Floats] | None = None,
) -> Estimate:
    """Decide all windows of all observations; `noise` is a first model, fitted to the motion itself.

    `elsewhere` are log-likelihood ratios (M,) of each window by motion of another kind, such as the robot's turning,
    which help to learn the plant and are not part of the result.
    `profile` is what is known of the robots' plant beforehand; without it all plants are equally likely.
    """
    prior, first_prior = log_prior(profile, FINE), log_prior(profile, COARSE)
    count = len(windows[0].tones)
    # All that is as large as windows times candidates: what is thought of them at first, and what is told in the end.
    ratios: Floats = np.empty((len(windows), count), dtype=np.float32 if count > WHOLE else np.float64)
    judged = _first_look(windows, motions, noise, first_prior, elsewhere, ratios)
    for look in range(_ROUNDS):
        _believe(judged)
        found = _all_statistics(judged, motions, noise)
        if look == 0:
            _judge_alone(judged, found)
        for _ in range(2):
            hypotheses = _judge(judged, found, prior)
            _believe(judged)
        if look == _ROUNDS - 1:
            _doubt_outliers(judged, found, hypotheses, motions, noise)
        _expect_signals(judged, hypotheses, noise)
        residuals = _residuals(judged, motions)
        noise = fit_recording_noise(motions, residuals)
        if look == 0:
            _look_again(judged, hypotheses, motions, noise)
    for state in judged:
        _tell_all_candidates(state)
    signals = tuple(state.signal for state in judged)
    return Estimate(ratios, signals, tuple(residuals), noise, _shared_plants(judged, found, prior))


def _shared_plants(judged: Sequence[_Judged], found: Sequence[Statistics], prior: Floats) -> Floats:
    """Probabilities (plants,) of one plant for all observations, whose gains are their own."""
    total = prior.copy()
    for said in _totals(judged, _said_by_plant(judged, found)).values():
        information = np.asarray(said.information)
        axes = information.shape[-1]
        total += half_log_evidence(np.eye(axes) / GAIN_VARIANCE + said.precision, information).sum(axis=0) + said.doubt
    return np.asarray(np.exp(total - log_sum_exp(total, axis=0)))


def _residuals(judged: Sequence[_Judged], motions: Sequence[Motion]) -> list[Floats]:
    """Each observation's motion less what all its windows are expected to add."""
    residuals = [motion.velocities.copy() for motion in motions]
    for state in judged:
        residuals[state.window.observation][:, state.window.first : state.window.last] -= state.signal
    return residuals


def _without_others(state: _Judged, residuals: Sequence[Floats]) -> Floats:
    """A window's motion less what all other windows are believed to add."""
    own = residuals[state.window.observation].copy()
    own[:, state.window.first : state.window.last] += state.signal
    return own


def _first_look(
    windows: Sequence[Window],
    motions: Sequence[Motion],
    noise: NoiseModel,
    prior: Floats,
    elsewhere: Sequence[Floats] | None,
    overviews: Floats,
) -> list[_Judged]:
    """Each window with the candidates that look best over all repeats of its symbol, and its row of `overviews`."""
    groups: dict[tuple[int, int], list[int]] = {}
    for index, window in enumerate(windows):
        groups.setdefault((window.observation, window.group), []).append(index)
    judged: dict[int, _Judged] = {}
    for members in groups.values():
        found = first_pass([windows[index] for index in members], motions, noise, prior)
        for index, ratios in zip(members, found.ratios, strict=True):
            window = windows[index]
            silent = np.zeros((len(motions[window.observation].velocities), window.last - window.first))
            others = np.broadcast_to(0.0, len(ratios)) if elsewhere is None else elsewhere[index]
            kept, overviews[index] = ratios[found.kept], ratios
            rows = response_rows(window, FINE)
            tones = window.tones.of(found.kept)
            judged[index] = _Judged(
                window, found.kept, tones, rows, kept, overviews[index], kept, _alike(kept), silent, others
            )
    if elsewhere is not None:
        _keep_best(list(judged.values()))
    return [judged[index] for index in range(len(windows))]


def _keep_best(judged: Sequence[_Judged]) -> None:
    """Keep the candidates that look best over all repeats of a symbol, whatever shows them."""
    for members in _groups(judged):
        total = np.sum([state.overview + state.elsewhere for state in members], axis=0)
        kept = np.argsort(-total)[:KEPT]
        for state in members:
            state.kept, state.ratios = kept, state.overview[kept].astype(np.float64)
            state.tones, state.by_plant = state.window.tones.of(kept), _alike(state.ratios)


def _alike(ratios: Floats) -> Floats:
    """Ratios (L,) that are the same under each plant: (L, plants)."""
    return np.repeat(ratios[:, None], len(FINE.taps), axis=1)


def _groups(judged: Sequence[_Judged]) -> list[list[_Judged]]:
    groups: dict[tuple[int, int], list[_Judged]] = {}
    for state in judged:
        groups.setdefault((state.window.observation, state.window.group), []).append(state)
    return list(groups.values())


def _believe(judged: Sequence[_Judged]) -> None:
    for members in _groups(judged):
        total = np.sum([state.ratios + state.elsewhere[state.kept] for state in members], axis=0)
        belief = np.exp(total - log_sum_exp(total, axis=0))
        for state in members:
            state.belief = belief


def _all_statistics(judged: Sequence[_Judged], motions: Sequence[Motion], noise: NoiseModel) -> list[Statistics]:
    residuals = _residuals(judged, motions)
    found = []
    for state in judged:
        window = state.window
        own = _without_others(state, residuals)
        found.append(statistics(window, state.tones, state.rows, noise, own))
    return found


@dataclass(frozen=True)
class _Hypothesis:
    """What one hypothesis says of one window: ratios (L,), plants (axes, plants), mean gains (axes, plants, A), and the
    precision (axes, plants, A, A) with which these are known without the window.
    """

    ratios: Floats
    plants: Floats
    gains: Floats
    known: Floats


@dataclass(frozen=True)
class _Said:
    """What windows say about the gains under each plant: `precision` (axes, plants, A, A) and `information` (axes,
    plants, A), expected over candidates; `doubt` (plants,) what the candidates leave open of that, nats.
    """

    precision: Floats | float = 0.0
    information: Floats | float = 0.0
    doubt: Floats | float = 0.0

    def __add__(self, other: "_Said") -> "_Said":
        return _Said(self.precision + other.precision, self.information + other.information, self.doubt + other.doubt)

    def __sub__(self, other: "_Said") -> "_Said":
        return _Said(self.precision - other.precision, self.information - other.information, self.doubt - other.doubt)


def _judge_alone(judged: Sequence[_Judged], found: Sequence[Statistics]) -> None:
    """Each window's candidates under each plant, its gains unknown to all others."""
    for state, data in zip(judged, found, strict=True):
        axes = data.information.shape[-1]
        state.by_plant = half_log_evidence(np.eye(axes) / GAIN_VARIANCE + data.precision, data.information).sum(axis=0)


def _said_by_plant(judged: Sequence[_Judged], found: Sequence[Statistics]) -> list[_Said]:
    """What each window says where all axes are alike. Each plant has beliefs of its own: under beliefs that all share,
    doubt would speak for plants that hardly move.
    """
    beliefs = {}
    for members in _groups(judged):
        total = np.sum([state.by_plant + state.elsewhere[state.kept][:, None] for state in members], axis=0)
        logs = total - log_sum_exp(total, axis=0)
        belief = np.exp(logs)
        doubt = -np.sum(belief * logs, axis=0) / len(members)
        beliefs.update({id(state): (belief, doubt) for state in members})
    return [
        _Said(
            np.einsum("lp,dlpab->dpab", belief, data.precision),
            np.einsum("lp,dlpa->dpa", belief, data.information),
            doubt,
        )
        for (belief, doubt), data in zip([beliefs[id(state)] for state in judged], found, strict=True)
    ]


def _said(judged: Sequence[_Judged], found: Sequence[Statistics]) -> list[_Said]:
    """What each window says about the gains under each plant, whatever the plant of other axes is."""
    return [
        _Said(
            np.einsum("l,dlpab->dpab", state.belief, data.precision),
            np.einsum("l,dlpa->dpa", state.belief, data.information),
        )
        for state, data in zip(judged, found, strict=True)
    ]


def _totals(judged: Sequence[_Judged], said: Sequence[_Said]) -> dict[int, _Said]:
    """The same of each observation, all its windows together."""
    totals: dict[int, _Said] = {}
    for state, entry in zip(judged, said, strict=True):
        totals[state.window.observation] = totals.get(state.window.observation, _Said()) + entry
    return totals


def _judge(judged: Sequence[_Judged], found: Sequence[Statistics], prior: Floats) -> list[list[_Hypothesis]]:
    """Refresh every window's ratios under the plant that the others show; returns the hypotheses used."""
    alike, apart = _said_by_plant(judged, found), _said(judged, found)
    own = _totals(judged, alike), _totals(judged, apart)
    together = sum(own[0].values(), _Said()), sum(own[1].values(), _Said())
    results = []
    for state, data, *entries in zip(judged, found, alike, apart, strict=True):
        sources = [tuple(totals[state.window.observation] for totals in own)]
        if len(own[0]) > 1:
            sources.append(together)
        hypotheses: list[_Hypothesis] = []
        by_plant = []
        for source in sources:
            hypothesis, gained = _under_alike(data, source[0] - entries[0], prior)
            hypotheses.append(hypothesis)
            by_plant.append(gained)
            if len(data.information) > 1:
                hypotheses.append(_under_apart(data, source[1] - entries[1], prior))
        ratios = np.stack([hypothesis.ratios for hypothesis in hypotheses])
        state.ratios = log_sum_exp(ratios, axis=0) - np.log(len(ratios))
        state.by_plant = log_sum_exp(np.stack(by_plant), axis=0)
        results.append(hypotheses)
    return results


def _under_alike(data: Statistics, said: _Said, prior: Floats) -> tuple[_Hypothesis, Floats]:
    """What follows from a plant that all observed axes share and of which others have `said` so much, with the log
    `prior` (plants,); and the ratios (L, plants) under each plant.
    """
    known, gains, alone, gained = _gained(data, said)
    by_plant = gained.sum(axis=0)
    shared = np.asarray(log_softmax(alone.sum(axis=0) + said.doubt + prior))
    ratios = log_sum_exp(by_plant + shared, axis=1)
    return _Hypothesis(ratios, np.broadcast_to(np.exp(shared), alone.shape), gains, known), by_plant


def _under_apart(data: Statistics, said: _Said, prior: Floats) -> _Hypothesis:
    """The same where each observed axis has a plant of its own."""
    known, gains, alone, gained = _gained(data, said)
    own = np.asarray(log_softmax(alone + prior, axis=1))
    ratios = log_sum_exp(gained + own[:, None], axis=2).sum(axis=0)
    return _Hypothesis(ratios, np.exp(own), gains, known)


def _gained(data: Statistics, said: _Said) -> tuple[Floats, Floats, Floats, Floats]:
    """Precision and mean of the gains by what others have said, its evidence (axes, plants), and what each candidate
    adds to that (axes, L, plants).
    """
    axes = data.information.shape[-1]
    known = np.asarray(np.eye(axes) / GAIN_VARIANCE + said.precision)
    information = np.asarray(said.information)
    alone = half_log_evidence(known, information)
    gains = np.linalg.solve(known, information[..., None])[..., 0]
    gained = half_log_evidence(known[:, None] + data.precision, information[:, None] + data.information)
    return known, gains, alone, gained - alone[:, None]


def _doubt_outliers(
    judged: Sequence[_Judged],
    found: Sequence[Statistics],
    hypotheses: Sequence[list[_Hypothesis]],
    motions: Sequence[Motion],
    noise: NoiseModel,
) -> None:
    """Let each kept candidate answer for the outliers that it leaves, under each hypothesis by itself."""
    residuals = _residuals(judged, motions)
    for state, data, alternatives in zip(judged, found, hypotheses, strict=True):
        own = _without_others(state, residuals)
        ratios = [
            each.ratios + outlier_correction(state.window, _signals_of(state, data, each), noise, own)
            for each in alternatives
        ]
        state.ratios = log_sum_exp(np.stack(ratios), axis=0) - np.log(len(ratios))
    _believe(judged)


def _signals_of(state: _Judged, data: Statistics, hypothesis: _Hypothesis) -> Floats:
    """What each kept candidate adds to the motion in units of the noise, (axes, L, n): by the plant and with the gains
    that are likeliest for it beside what the other windows say, each axis by itself.
    """
    known = hypothesis.known
    information = np.einsum("dpab,dpb->dpa", known, hypothesis.gains)
    precision = known[:, None] + data.precision
    pulled = information[:, None] + data.information
    with np.errstate(divide="ignore"):
        likely = np.log(hypothesis.plants) - half_log_evidence(known, information)
    plants = np.argmax(half_log_evidence(precision, pulled) + likely[:, None], axis=2)
    axes, rows = np.indices(plants.shape)
    fitted = np.linalg.solve(precision[axes, rows, plants], pulled[axes, rows, plants][..., None])[..., 0]
    tones = np.einsum("dla,lak->dlk", fitted, state.tones)
    return np.stack(
        [np.einsum("lk,lkn->ln", own, state.rows[chosen]) for own, chosen in zip(tones, plants, strict=True)]
    )


def _expect_signals(judged: Sequence[_Judged], hypotheses: Sequence[list[_Hypothesis]], noise: NoiseModel) -> None:
    for state, alternatives in zip(judged, hypotheses, strict=True):
        tones = np.einsum("l,lak->ak", state.belief, state.tones)
        heard = np.einsum("ak,pkn->pan", tones, state.rows)
        scales = noise.scales[state.window.observation]
        state.signal = np.einsum("dpa,pan->dn", _mean_gains(alternatives), heard) * scales[:, None]


def _mean_gains(alternatives: Sequence[_Hypothesis]) -> Floats:
    """Gains times the plants' probabilities, expected over the hypotheses: (observed axes, plants, A)."""
    weights = softmax([float(log_sum_exp(item.ratios, axis=0)) for item in alternatives])
    return np.asarray(
        sum(weight * item.plants[..., None] * item.gains for weight, item in zip(weights, alternatives, strict=True))
    )


def _look_again(
    judged: Sequence[_Judged], hypotheses: Sequence[list[_Hypothesis]], motions: Sequence[Motion], noise: NoiseModel
) -> None:
    """Choose anew which candidates are kept, of all, under the one plant that the other windows show by now.

    Under the prior alone the symbol that was sent may stand behind many others of a large alphabet.
    """
    if all(len(state.kept) == len(state.overview) for state in judged):
        return
    residuals = _residuals(judged, motions)
    known = {id(state): alternatives for state, alternatives in zip(judged, hypotheses, strict=True)}
    for state in judged:
        state.overview[:] = _under_one_plant(state, _mean_gains(known[id(state)]), residuals, noise)
    _keep_best(judged)


def _under_one_plant(state: _Judged, gains: Floats, residuals: Sequence[Floats], noise: NoiseModel) -> Floats:
    """Log-likelihood ratios (M,) of all candidates of a window where the response is known."""
    window = state.window
    own = _without_others(state, residuals)
    pulled, weights, filters, history = pulled_by(window, noise, own)
    responses = np.einsum("dpa,pkn->dakn", gains, state.rows, optimize=True)
    linear, quadratic = np.zeros(responses[0, ..., 0].size), 0.0
    for axis in range(len(pulled)):
        heard = whitened_from_silence(responses[axis], history, filters[axis]).reshape(len(linear), -1)
        linear += heard @ pulled[axis]
        quadratic = quadratic + (heard * weights[axis]) @ heard.T
    return window.tones.ratios(linear, np.asarray(quadratic))


def _tell_all_candidates(state: _Judged) -> None:
    """Make the overview the ratios of all M: those dropped after a look at all stand below the worst that was kept."""
    state.overview += state.ratios.min() - state.overview[state.kept].min()
    np.minimum(state.overview, state.ratios.min(), out=state.overview)
    state.overview[state.kept] = state.ratios
