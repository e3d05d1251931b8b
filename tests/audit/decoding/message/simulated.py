"""Log-likelihood ratios as a receiver of orthogonal signals in Gaussian noise has them."""

import numpy as np


def simulated_ratios(symbols, alphabet_size, distance, draw, missing=0.0):
    """Ratios (L, M): N(d^2/2, d^2) for the symbol sent and N(-d^2/2, d^2) for others; unseen rows are zeros."""
    means = np.full((len(symbols), alphabet_size), -(distance**2) / 2)
    means[np.arange(len(symbols)), symbols] *= -1.0
    ratios = means + distance * draw.normal(size=means.shape)
    ratios[draw.random(len(symbols)) < missing] = 0.0
    return ratios
