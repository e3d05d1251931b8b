"""Mean of an exponential of a waveform's tones over the law that the key stream gives them, in closed form.

A candidate's tones on one axis are a vector t of d = 2 K real numbers, the real and imaginary parts of K tones. Over
keys it is normal with variance 1 / K (`power = "ensemble"`) or uniform on the sphere |t|^2 = 2 (`power = "window"`).
A spectrum multiplies t by fixed factors, which are moved into the weights beforehand (`channel_terms`).
Both functions return log E exp(u . t - sum_k q_k t_k^2 / 2) for weights u of any sign and q >= 0.
"""

import numpy as np
from scipy.special import gammaln

from mtm_audit.model.track import Floats

SPHERE_SQUARED_RADIUS = 2.0

_NEWTON_STEPS = 60
_CONVERGED = 1e-12
# Heights y of the contour s(y) = s0 + w (i y - b y^2), where w is the saddle's width and b bends it along the steepest
# descent, so that the integrand falls like a Gaussian even where d is small.
# Below the axis the integrand is the complex conjugate.
_STEP = 0.5
_HEAVY = 100.0
_MOST_BENT = 0.15
_HEIGHTS = np.arange(0.0, 8.5, _STEP)


def log_mean_normal(linear: Floats, quadratic: Floats) -> Floats:
    """Log mean for t normal with variance 2 / d an element; `linear`, `quadratic` (..., d), result (...)."""
    precision = 0.5 * linear.shape[-1]
    total = precision + quadratic
    return np.asarray(0.5 * np.sum(linear**2 / total - np.log1p(quadratic / precision), axis=-1))


def log_mean_sphere(linear: Floats, quadratic: Floats) -> Floats:
    """Log mean for t uniform on the sphere of squared radius 2; `linear`, `quadratic` (..., d), result (...).

    This is the normalising constant of the Fisher-Bingham distribution, by its one-dimensional inverse Laplace
    transform (Kume and Wood 2005, equation 8), integrated through the saddle point.
    """
    squared, spread = np.broadcast_arrays(np.square(linear), quadratic)
    dimension, radius = squared.shape[-1], SPHERE_SQUARED_RADIUS
    least = spread.min(axis=-1, keepdims=True)
    spread = spread - least
    saddle = _saddle(squared, spread, radius)
    shifted = saddle[..., None] + spread
    curvature = np.sum(0.5 / shifted**2 + squared / shifted**3, axis=-1)
    width = 1.0 / np.sqrt(curvature)
    bend = np.sum(1.0 / shifted**3 + 3.0 * squared / shifted**4, axis=-1) * width**3 / 6.0
    # A far bent contour would pass round the poles of large weights on elements other than the saddle's nearest.
    heavy = np.max(squared * (spread > 0.0), axis=-1) > _HEAVY
    bend = np.where(heavy, np.minimum(bend, _MOST_BENT), bend)
    steps = 1j * _HEIGHTS - bend[..., None] * _HEIGHTS**2
    place = shifted[..., None, :] + (width[..., None] * steps)[..., None]
    exponent = np.sum(-0.5 * np.log(place) + 0.5 * squared[..., None, :] / place, axis=-1)
    exponent += 0.5 * radius * (saddle[..., None] + width[..., None] * steps)
    top = exponent.real.max(axis=-1, keepdims=True)
    slope = 1.0 + 2j * bend[..., None] * _HEIGHTS
    heights = (np.exp(exponent - top) * slope).real
    area = (np.sum(heights, axis=-1) - 0.5 * heights[..., 0]) * _STEP / np.pi
    constant = (0.5 * dimension - 1.0) * np.log(2.0) + gammaln(0.5 * dimension)
    constant += (1.0 - 0.5 * dimension) * np.log(radius)
    return np.asarray(constant + np.log(width * area) + top[..., 0] - 0.5 * radius * least[..., 0])


def _saddle(squared: Floats, spread: Floats, radius: float) -> Floats:
    """The s > 0 at which sum 1 / (s + spread) + squared / (s + spread)^2 is `radius`; the least spread is 0.

    Newton's method from the left, where the falling convex sum is too large, so that it never oversteps.
    """
    total = squared.sum(axis=-1)
    dimension = squared.shape[-1]

    def alone(count: float, weight: Floats) -> Floats:
        return np.asarray((count + np.sqrt(count**2 + 4.0 * radius * weight)) / (2.0 * radius))

    first = np.take_along_axis(squared, np.argmin(spread, axis=-1)[..., None], axis=-1)[..., 0]
    place = np.maximum(alone(1.0, first), alone(float(dimension), total) - spread.max(axis=-1))
    for _ in range(_NEWTON_STEPS):
        shifted = place[..., None] + spread
        excess = np.sum(1.0 / shifted + squared / shifted**2, axis=-1) - radius
        slope = np.sum(1.0 / shifted**2 + 2.0 * squared / shifted**3, axis=-1)
        step = excess / slope
        place = place + step
        if np.all(np.abs(step) <= _CONVERGED * place):
            break
    return np.asarray(place)
