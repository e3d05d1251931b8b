"""A Gaussian policy that draws its noise from the key."""

from collections.abc import Callable
from typing import Generic, TypeVar

from mtm_onboard.policies.bounds import ActionBounds
from mtm_onboard.policies.keyednoise import Floats, KeyedNoise
from mtm_onboard.policies.vectornoise import VectorKeyedNoise
from mtm_onboard.protocol.errors import MtmError

Observation = TypeVar("Observation")


class KeyedGaussian(Generic[Observation]):
    """Acts with mean + std * eps, eps being the keyed noise instead of a random draw.

    `distribution` says the mean and standard deviation of an observation's action, each of shape (axes,), or
    (envs, axes) with the noise of several environments. Under a scheme with power = "ensemble" each eps is exactly
    standard normal over the keys, so each action has the distribution that the policy was trained with. `bounds`, when
    given, clips the actions and counts it. Raises MtmError when the noise has no random generator for the ticks and
    components without a message, on which the policy would be a deterministic one.
    """

    def __init__(
        self,
        distribution: Callable[[Observation], tuple[Floats, Floats]],
        noise: KeyedNoise | VectorKeyedNoise,
        bounds: ActionBounds | None = None,
    ) -> None:
        noises = noise.noises if isinstance(noise, VectorKeyedNoise) else (noise,)
        if any(one.random is None for one in noises):
            raise MtmError(
                "a Gaussian policy needs noise where no message is sent as well; give each KeyedNoise "
                "random=numpy.random.default_rng()"
            )
        self._distribution = distribution
        self._noise = noise
        self._bounds = bounds

    def __call__(self, observation: Observation) -> Floats:
        """The action of this step, shape as the mean's; raises MtmError as `ActionBounds.clip` does."""
        mean, std = self._distribution(observation)
        action: Floats = mean + std * self._noise()
        return action if self._bounds is None else self._bounds.clip(action)
