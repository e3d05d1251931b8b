"""The noise of a rollout, tick by tick, in the order of a world's axes: keyed, white or none."""

from collections.abc import Sequence

import numpy as np

from mtm_audit.model.track import Floats
from mtm_onboard.protocol import Codebook, Scheme
from mtm_onboard.protocol.framing import channel_symbols
from mtm_onboard.runtime.modulator import Modulator


def axis_columns(scheme: Scheme, axes: Sequence[str]) -> dict[str, list[int]]:
    """For each channel by name, the numbers of its axes among `axes`, which are named `<body>.<axis>`."""
    return {
        channel.name: [list(axes).index(f"{channel.body}.{axis}") for axis in channel.axes]
        for channel in scheme.channels
    }


def keyed_noise(codebook: Codebook, messages: Sequence[Sequence[int]], axes: Sequence[str]) -> Floats:
    """What the modulators of all channels add while they send `messages` one after the other: (ticks, axes).

    Each message is the whole message's symbols; axes that no channel uses stay at zero.
    """
    scheme = codebook.scheme
    columns = axis_columns(scheme, axes)
    noise = np.zeros((len(messages), scheme.message_ticks, len(axes)))
    for number, symbols in enumerate(messages):
        for name, own in channel_symbols(symbols, scheme).items():
            modulator = Modulator(codebook, name, own, repeat=False)
            sigma = modulator.channel.sigma
            noise[number][:, columns[name]] = [
                sigma * modulator.perturbation(tick) for tick in range(scheme.message_ticks)
            ]
    return noise.reshape(-1, len(axes))


def white_noise(scheme: Scheme, ticks: int, axes: Sequence[str], generator: np.random.Generator) -> Floats:
    """White Gaussian noise of the same standard deviations on the same axes: (ticks, axes)."""
    columns = axis_columns(scheme, axes)
    noise = np.zeros((ticks, len(axes)))
    for channel in scheme.channels:
        own = columns[channel.name]
        noise[:, own] = channel.sigma * generator.standard_normal((ticks, len(own)))
    return noise
