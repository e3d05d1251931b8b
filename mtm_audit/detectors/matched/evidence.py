"""Gaussian evidence: how much better the data are explained with a waveform of unknown gain than without."""

import numpy as np

from mtm_audit.model.track import Floats

# Prior variance of a gain, in units of the innovation's standard deviation per unit of waveform.
GAIN_VARIANCE = 6.0


def half_log_evidence(precision: Floats, information: Floats) -> Floats:
    """(h' Q^-1 h - log det Q) / 2 for stacks of small systems: Q (..., A, A) symmetric positive, h (..., A).

    A Cholesky factorisation written out over the few axes, so that it runs over the whole stack at once.
    """
    axes = information.shape[-1]
    rows: list[list[Floats]] = []
    solved: list[Floats] = []
    # Grows from its first term, whose layout in memory is that of the stack.
    total: Floats | float = 0.0
    for row in range(axes):
        factors: list[Floats] = []
        for column in range(row):
            value = precision[..., row, column]
            for inner in range(column):
                value = value - factors[inner] * rows[column][inner]
            factors.append(value / rows[column][column])
        diagonal = precision[..., row, row]
        residual = information[..., row]
        for column in range(row):
            diagonal = diagonal - factors[column] ** 2
            residual = residual - factors[column] * solved[column]
        root = np.sqrt(diagonal)
        factors.append(root)
        rows.append(factors)
        solved.append(residual / root)
        total = total + (0.5 * solved[row] ** 2 - np.log(root))
    return np.asarray(total)


def log_sum_exp(values: Floats, axis: int) -> Floats:
    """log(sum(exp(values))) along an axis, without overflow; minus infinity where nothing is larger.

    As scipy's, in a fraction of the time: tables have millions of entries, and numpy reduces a short last axis in many
    small steps.
    """
    first = np.array(np.moveaxis(values, axis, 0), order="C")
    top = np.maximum(np.max(first, axis=0), np.finfo(values.dtype).min)
    first -= top
    np.exp(first, out=first)
    with np.errstate(divide="ignore"):
        result: Floats = top + np.log(np.sum(first, axis=0))
    return result
