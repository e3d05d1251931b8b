"""The noise of a rollout, tick by tick, in the order of a world's axes: keyed, white or none.

Keyed noise comes from the onboard runtime's Modulator, which is all of the runtime that the four worlds use.
"""

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
    """(ticks, axes): what the channels' modulators add to the commands while they send `messages` in a row.

    In units of the command. Each of `messages` holds all symbols of one message; axes of no channel stay zero. It is
    what the encoding of the paper's Section "Encoding and Decoding" injects.
    """
    scheme = codebook.scheme
    columns = axis_columns(scheme, axes)
    noise = np.zeros((len(messages), scheme.message_ticks, len(axes)))
    for number, symbols in enumerate(messages):
        for name, own in channel_symbols(symbols, scheme).items():
            modulator = Modulator(codebook, name, own, repeat=False)
            sigma = np.array(modulator.channel.sigmas)
            noise[number][:, columns[name]] = [
                sigma * modulator.perturbation(tick) for tick in range(scheme.message_ticks)
            ]
    return noise.reshape(-1, len(axes))


def white_noise(scheme: Scheme, ticks: int, axes: Sequence[str], generator: np.random.Generator) -> Floats:
    """(ticks, axes): white Gaussian noise of the scheme's standard deviations on the scheme's axes."""
    columns = axis_columns(scheme, axes)
    noise = np.zeros((ticks, len(axes)))
    for channel in scheme.channels:
        own = columns[channel.name]
        noise[:, own] = np.array(channel.sigmas) * generator.standard_normal((ticks, len(own)))
    return noise
