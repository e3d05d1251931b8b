"""The stochastic policy of the Reacher world: the actor of a soft actor-critic, as its training wrote it."""

from dataclasses import dataclass
from importlib import resources

import numpy as np
from numpy.typing import NDArray

from mtm_audit.model.track import Floats

# Bounds that Stable-Baselines3 keeps the logarithm of the standard deviation in.
LOG_STD_BOUNDS = (-20.0, 2.0)

Layer = tuple[NDArray[np.float32], NDArray[np.float32]]


@dataclass(frozen=True)
class GaussianPolicy:
    """A Gaussian over actions before the squashing by tanh, whose mean and deviation two hidden layers give.

    Each layer is its weights (inputs, outputs) and its biases (outputs,).
    """

    hidden: tuple[Layer, ...]
    mean: Layer
    log_std: Layer

    def distribution(self, observations: Floats) -> tuple[Floats, Floats]:
        """Means and standard deviations, (n, 2) each, before tanh, for observations (n, 10)."""
        values = observations.astype(np.float32)
        for weights, biases in self.hidden:
            values = np.maximum(values @ weights + biases, 0.0)
        mean = values @ self.mean[0] + self.mean[1]
        log_std = values @ self.log_std[0] + self.log_std[1]
        return mean.astype(np.float64), np.exp(np.clip(log_std, *LOG_STD_BOUNDS).astype(np.float64))


def trained_policy() -> GaussianPolicy:
    """The policy that `hil.worlds.reacher_training` trained."""
    with resources.files("hil.worlds").joinpath("reacher_policy.npz").open("rb") as file, np.load(file) as arrays:
        layers = {
            name: (arrays[f"{name}_weights"], arrays[f"{name}_biases"])
            for name in ("hidden0", "hidden1", "mean", "log_std")
        }
    return GaussianPolicy((layers["hidden0"], layers["hidden1"]), layers["mean"], layers["log_std"])
