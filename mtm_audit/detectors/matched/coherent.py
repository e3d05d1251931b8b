"""Evidence of timing hypotheses with one set of gains for all windows of a recording.

Window by window, unknown gains cost more than a short window has to give; shared by all windows they cost once.
The gains are found by expectation-maximisation from several rotations and mirrorings of the camera, and each set of
them takes what it explains off the interference again (`relief`).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from mtm_audit.detectors.matched.candidates import WHOLE, Tones
from mtm_audit.detectors.matched.correlate import Heard, template_power
from mtm_audit.detectors.matched.evidence import GAIN_VARIANCE
from mtm_audit.detectors.matched.relief import Relief, relief_of
from mtm_audit.model.track import Bools, Floats

_FIRST_ROUNDS = 2
_LAST_ROUNDS = 3
_KEPT = 32
# Hypotheses times windows of one computation; each takes about a kilobyte.
_MOST_TOGETHER = 32_768
# Windows times candidates of one product of matrices.
_MOST_CORRELATED = 1 << 18
# Whole cells at which all candidates are weighed at once.
_CELLS = 64
# Windows times such candidates of one computation.
_MOST_FEW = 1 << 15
# Of a large alphabet so many candidates are looked at around each whole cell.
_NEAR_A_CELL = 128


@dataclass(frozen=True)
class Question:
    """Timings whose evidence one codebook is asked for.

    `tones` holds one array (M, axes, 2 K) for each window, or a single one that serves all; `lags` (hypotheses,
    windows): where each window begins, in cells of what was heard and fractions of them; `inside` which of them count.
    """

    tones: Sequence[Tones]
    lags: Floats
    inside: Bools


def coherent_evidence(heard: Heard, questions: Sequence[Question], step_s: float) -> list[Floats]:
    """Log evidence of each question's hypotheses, (hypotheses,) each.

    Many codebooks are asked about few timings, so questions are answered together as far as memory allows.
    """
    seen: dict[int, _Seen] = {}
    for question in questions:
        # Codebooks that are asked about the same timings share what was heard there.
        if id(question.lags) not in seen:
            seen[id(question.lags)] = _windows_seen(question)
    answers: list[Floats] = [np.empty(0)] * len(questions)
    by_windows: dict[int, list[int]] = {}
    for number, question in enumerate(questions):
        by_windows.setdefault(seen[id(question.lags)].lags.shape[1], []).append(number)
    for windows, numbers in by_windows.items():
        most = max(1, _MOST_TOGETHER // max(1, windows))
        sizes = np.cumsum([len(questions[number].lags) for number in numbers])
        for batch in np.split(np.array(numbers), np.flatnonzero(np.diff(sizes // most)) + 1):
            asked = [(questions[number].tones, seen[id(questions[number].lags)]) for number in batch]
            found = np.split(_answer(heard, asked, step_s), np.cumsum([len(each.lags) for _, each in asked])[:-1])
            for number, evidence in zip(batch, found, strict=True):
                answers[number] = evidence
    return answers


@dataclass(frozen=True)
class _Seen:
    """The windows of a question that are inside, moved together: each (hypotheses, windows).

    `numbers` says which window of the question each is; where a hypothesis has fewer than others, `inside` is False.
    """

    lags: Floats
    numbers: NDArray[np.int64]
    inside: Bools


def _windows_seen(question: Question) -> _Seen:
    most = max(1, int(question.inside.sum(axis=1).max(initial=0)))
    numbers = np.argsort(~question.inside, axis=1, kind="stable")[:, :most]
    lags = np.take_along_axis(question.lags, numbers, axis=1)
    return _Seen(lags, numbers, np.take_along_axis(question.inside, numbers, axis=1))


def _answer(heard: Heard, asked: Sequence[tuple[Sequence[Tones], _Seen]], step_s: float) -> Floats:
    """Evidence of all questions' hypotheses, one after the other."""
    first = asked[0][0][0]
    count, axes, observed = len(first), first.shape[1], len(heard.projections)
    informations, energies = [], []
    places: dict[int, _Shifted] = {}
    for tones, seen in asked:
        if id(seen) not in places:
            places[id(seen)] = _shifted(heard, seen.lags, step_s)
        place = places[id(seen)]
        looked_at = _information_of_few if count > WHOLE else _information
        informations.append(looked_at(place, seen, tones))
        energy = place.weights[..., None] * template_power(tones[0], heard)
        # Every pair of an observed and an injected axis has a gain: (hypotheses, windows, pairs).
        energies.append(energy.reshape(*seen.lags.shape, observed * axes))
    visible = np.concatenate([seen.inside for _, seen in asked])[..., None]
    pairs: Floats = (np.concatenate(energies) * visible).astype(np.float32)
    information = np.concatenate(informations)
    information *= visible[..., None]
    relief = relief_of(heard, first)
    shown = [(places[id(seen)].columns, places[id(seen)].weights) for _, seen in asked]
    ends = np.cumsum([len(seen.lags) for _, seen in asked])[:-1]

    def by_chance(gains: Floats) -> Floats:
        return np.concatenate(
            [relief.by_chance(*each, own) for each, own in zip(shown, np.split(gains, ends), strict=True)]
        )

    gains = np.repeat(starting_gains(observed, axes)[None], len(information), axis=0)
    for _ in range(_FIRST_ROUNDS):
        gains = _better_gains(information, pairs, gains, count, relief)
    fits = _fit(information, pairs, gains, count, visible, relief, by_chance(gains))
    gains = np.take_along_axis(gains, np.argmax(fits, axis=1)[:, None, None], axis=1)
    for _ in range(_LAST_ROUNDS):
        gains = _better_gains(information, pairs, gains, count, relief)
    spent = 0.5 * np.log1p(GAIN_VARIANCE * pairs.sum(axis=1)).sum(axis=1)
    return np.asarray(_fit(information, pairs, gains, count, visible, relief, by_chance(gains))[:, 0] - spent)


@dataclass(frozen=True)
class _Shifted:
    """What was heard at given lags: `columns` (hypotheses, windows, observed axes, 2 K), and the `weights` of the cells
    (hypotheses, windows, observed axes); taken from `heard` at `lags` (hypotheses, windows).
    """

    columns: NDArray[np.float32]
    weights: Floats
    heard: Heard
    lags: Floats


def _shifted(heard: Heard, lags: Floats, step_s: float) -> _Shifted:
    """What was heard at `lags` (hypotheses, windows), whole cells and the fraction of one by phase."""
    whole = np.clip(np.rint(lags).astype(np.int64), 0, heard.seen.shape[1] - 1)
    turn = np.exp(-2j * np.pi * heard.tones_hz[:, None, None] * (lags - whole) * step_s)
    tone_count = len(heard.tones_hz)
    complex_heard = heard.projections[:, :tone_count] + 1j * heard.projections[:, tone_count:]
    turned = complex_heard[:, :, whole] * turn
    parts = np.concatenate([turned.real, turned.imag], axis=1).astype(np.float32)
    columns = np.ascontiguousarray(parts.transpose(2, 3, 0, 1))
    return _Shifted(columns, heard.seen[:, whole].transpose(1, 2, 0), heard, lags)


def _information(place: _Shifted, seen: _Seen, tones: Sequence[Tones]) -> NDArray[np.float32]:
    """Correlations of the best candidates, (hypotheses, windows, kept, pairs of axes)."""
    count, axes, width = tones[0].shape
    hypotheses, windows, observed, _ = place.columns.shape
    kept = min(count, _KEPT)
    result = np.zeros((hypotheses, windows, kept, observed * axes), dtype=np.float32)
    own = seen.numbers % len(tones)
    for number in np.unique(own[seen.inside]):
        # The windows of all hypotheses that are played from the same waveforms, at most so many at once.
        rows, places = np.nonzero((own == number) & seen.inside)
        flat = tones[number].reshape(count * axes, width)
        for chunk in np.array_split(np.arange(len(rows)), -(-len(rows) * count // _MOST_CORRELATED)):
            columns = place.columns[rows[chunk], places[chunk]].reshape(-1, width)
            correlated = (columns @ flat.T).reshape(len(chunk), observed, count, axes)
            values = correlated.transpose(0, 2, 1, 3).reshape(len(chunk), count, observed * axes)
            if kept < count:
                strongest = np.argpartition(-np.sum(values**2, axis=2), kept, axis=1)[:, :kept]
                values = np.take_along_axis(values, strongest[:, :, None], axis=1)
            result[rows[chunk], places[chunk]] = values
    return result


def _information_of_few(place: _Shifted, seen: _Seen, tones: Sequence[Tones]) -> NDArray[np.float32]:
    """As `_information`, of the candidates alone that are strongest at the whole cells next to a window's lag.

    Timings of one question lie close together, so that they share most cells. A candidate that is strong between two
    cells is so at one of them; one that is missed would only have added evidence.
    """
    _, axes, width = tones[0].shape
    hypotheses, windows, observed, _ = place.columns.shape
    result = np.zeros((hypotheses, windows, _KEPT, observed * axes), dtype=np.float32)
    own = seen.numbers % len(tones)
    for number in np.unique(own[seen.inside]):
        rows, places = np.nonzero((own == number) & seen.inside)
        below = np.floor(place.lags[rows, places]).astype(np.int64)
        cells = np.unique([below, below + 1])
        near = _strongest_by_cell(place.heard, cells, tones[number])
        order = np.argsort(below, kind="stable")
        # Windows between the same two cells have the same candidates; at most so many of them at once.
        between, first = np.unique(below[order], return_index=True)
        for cell, several in zip(between, np.split(order, first[1:]), strict=True):
            at = int(np.searchsorted(cells, cell))
            # One candidate may be near both cells: it must count once.
            chosen = np.unique(near[at : at + 2])
            few = tones[number][chosen].reshape(-1, width)
            for chunk in np.array_split(several, -(-len(several) * len(chosen) // _MOST_FEW)):
                columns = place.columns[rows[chunk], places[chunk]].reshape(-1, width)
                values = (columns @ few.T).reshape(len(chunk), observed, len(chosen), axes)
                values = values.transpose(0, 2, 1, 3).reshape(len(chunk), len(chosen), observed * axes)
                strongest = np.argpartition(-np.sum(values**2, axis=2), _KEPT, axis=1)[:, :_KEPT]
                result[rows[chunk], places[chunk]] = np.take_along_axis(values, strongest[:, :, None], axis=1)
    return result


def _strongest_by_cell(heard: Heard, cells: NDArray[np.int64], tones: Tones) -> NDArray[np.int64]:
    """The candidates that correlate most with what was heard at whole lags, (cells, `_NEAR_A_CELL`)."""
    count, axes, _ = tones.shape
    columns = heard.projections[:, :, np.clip(cells, 0, heard.seen.shape[1] - 1)].transpose(0, 2, 1)
    result = np.empty((len(cells), _NEAR_A_CELL), dtype=np.int64)
    for first in range(0, len(cells), _CELLS):
        rows = np.ascontiguousarray(columns[:, first : first + _CELLS])
        strength = np.zeros((rows.shape[1], count), dtype=np.float32)
        for begin in range(0, count, _MOST_CORRELATED // _CELLS):
            own = tones[begin : begin + _MOST_CORRELATED // _CELLS]
            part = strength[:, begin : begin + len(own)]
            for axis in range(axes):
                for row in rows:
                    correlated = row @ own[:, axis].T
                    correlated *= correlated
                    part += correlated
        result[first : first + _CELLS] = np.argpartition(strength, count - _NEAR_A_CELL, axis=1)[:, -_NEAR_A_CELL:]
    return result


def starting_gains(observed: int, axes: int) -> NDArray[np.float32]:
    """Quarter turns of a plain camera and of a mirrored one, at the prior's magnitude: (starts, pairs of axes)."""
    plain = np.eye(observed, axes)
    if observed == 1:
        return np.stack([plain, -plain]).reshape(2, -1).astype(np.float32) * np.float32(np.sqrt(GAIN_VARIANCE))
    starts = []
    for mirror in (1.0, -1.0) if axes > 1 else (1.0,):
        for cosine, sine in ((1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)):
            turned = plain.copy()
            turned[1] *= mirror
            turned[:2] = np.array([[cosine, -sine], [sine, cosine]]) @ turned[:2]
            starts.append(turned.ravel())
    return np.stack(starts).astype(np.float32) * np.float32(np.sqrt(GAIN_VARIANCE))


def _ratios(information: Floats, energy: Floats, gains: Floats, factors: Floats) -> Floats:
    """Log-likelihood ratios (hypotheses, windows, kept, starts); `gains` and the relief's `factors` (hypotheses,
    starts, pairs).
    """
    hypotheses, windows, kept, pairs = information.shape
    pulled, spent = (gains * factors).transpose(0, 2, 1), (gains**2 * factors).transpose(0, 2, 1)
    linear = (information.reshape(hypotheses, windows * kept, pairs) @ pulled).reshape(hypotheses, windows, kept, -1)
    return np.asarray(linear - 0.5 * (energy @ spent)[:, :, None])


def _log_mixture(ratios: Floats, count: int, by_chance: Floats | float = 0.0) -> Floats:
    """Log of silence plus the mean over all M candidates, (hypotheses, windows, starts); others than the kept add 0.

    `by_chance` (hypotheses, windows, starts) is the log of what the mean of random candidates would be.
    """
    top = np.maximum(ratios.max(axis=2), by_chance)
    mean = np.exp(ratios - top[:, :, None]).sum(axis=2) / count
    return np.asarray(np.log(np.exp(by_chance - top) + mean) + top - by_chance)


def _fit(
    information: Floats, energy: Floats, gains: Floats, count: int, visible: Bools, relief: Relief, by_chance: Floats
) -> Floats:  # fmt: skip
    """Log-likelihood of the windows seen plus log prior of the gains, (hypotheses, starts)."""
    ratios = _ratios(information, energy, gains, relief.factors(gains))
    carried = _log_mixture(ratios, count, by_chance) - np.log(2.0)
    fit = np.where(visible, carried, 0.0).sum(axis=1) - 0.5 * np.sum(gains**2, axis=2) / GAIN_VARIANCE
    return np.asarray(fit)


def _better_gains(information: Floats, energy: Floats, gains: Floats, count: int, relief: Relief) -> Floats:
    """One step of expectation-maximisation."""
    factors = relief.factors(gains)
    ratios = _ratios(information, energy, gains, factors)
    belief = np.exp(ratios - _log_mixture(ratios, count)[:, :, None]) / count
    hypotheses, windows, kept, starts = belief.shape
    turned = belief.reshape(hypotheses, windows * kept, starts).transpose(0, 2, 1)
    pulled = turned @ information.reshape(hypotheses, windows * kept, -1) * factors
    weight = belief.sum(axis=2).transpose(0, 2, 1) @ energy * factors + 1.0 / GAIN_VARIANCE
    return np.asarray(pulled / weight)
