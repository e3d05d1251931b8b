"""One rollout of a simulated world under any scheme of its channels: which symbols each channel has right."""

import tomllib
from dataclasses import replace

import numpy as np

from hil.experiments.detectors.accuracy_rollout import DETECTORS, right_symbols
from hil.experiments.runs.cells import Scalar, Values
from hil.experiments.worlds.reading import read_windows
from hil.experiments.worlds.rollout import film_and_track
from hil.worlds.noise import keyed_noise
from hil.worlds.registry import make_world
from hil.worlds.schemes import SIGNALS, split_scheme
from hil.worlds.world import Integers, World, check_axes
from mtm_onboard.protocol import Codebook, MtmError, Scheme
from mtm_onboard.protocol.errors import WrongValueError
from mtm_onboard.protocol.framing import channel_symbols
from mtm_onboard.protocol.scheme import scheme_from_table
from mtm_onboard.protocol.schemefile import scheme_text

_KEYS_STREAM, _SYMBOLS_STREAM = 9, 10


def world_scheme(world: str, alphabet_size: int, window_ticks: int, windows: int) -> Scheme:
    """All channels of the world with so many equal windows each."""
    return split_scheme(world, alphabet_size, window_ticks * windows, (windows,) * len(SIGNALS[world].channels))


def world_parameters(world: str, scheme: Scheme, detector: str) -> dict[str, Scalar]:
    """Parameters of a cell for `read_world`.

    Raises MtmError when there is no such detector, the simulator is missing, or the scheme is not for this world.
    """
    if detector not in DETECTORS:
        raise WrongValueError(
            f"there is no detector {detector!r} to measure with; choose one of: {', '.join(DETECTORS)}"
        )
    made = make_world(world)
    check_axes(made, scheme)
    if scheme.rate_hz != made.rate_hz:
        raise MtmError(f"{world} runs at {made.rate_hz:g} Hz, the scheme at {scheme.rate_hz:g}; make them equal")
    return {"simulator": world, "scheme": scheme_text(scheme), "detector": detector}


def read_world(parameters: Values, seed: int) -> dict[str, Scalar]:
    """Send random symbols with a key of its own while the world does its task, and decode each window of the film.

    Gives what `accuracy_rollout.right_symbols` does.
    """
    # The waveforms make no difference to the accuracy, and under a fixed schedule they do not depend on the time of
    # day.
    scheme = replace(scheme_from_table(tomllib.loads(str(parameters["scheme"]))["scheme"]), schedule="fixed")
    world = make_world(str(parameters["simulator"]))
    codebook = Codebook(np.random.default_rng([_KEYS_STREAM, seed]).bytes(32), scheme)
    drawn = np.random.default_rng([_SYMBOLS_STREAM, seed]).integers(scheme.alphabet_size, size=scheme.message_symbols)
    symbols = tuple(int(symbol) for symbol in drawn)
    goals = _goals(world, seed)
    ticks = -(-scheme.message_ticks // len(goals))
    noise = np.zeros((len(goals) * ticks, len(world.axes)))
    noise[: scheme.message_ticks] = keyed_noise(codebook, [symbols], world.axes)
    (rollout,) = world.run(goals[None], noise.reshape(1, len(goals), ticks, -1), [seed])
    seen = film_and_track(world, rollout, scheme)
    scores = read_windows(codebook, seen, 1, str(parameters["detector"]))
    return right_symbols(scheme, scores, channel_symbols(symbols, scheme))


def _goals(world: World, seed: int) -> Integers:
    """All goals in a row, or one goal in the world that films each goal separately."""
    if world.name == "lunar-lander":
        return np.array([seed % world.choices])
    return np.random.default_rng([_SYMBOLS_STREAM, seed, 1]).integers(world.choices, size=world.goals)
