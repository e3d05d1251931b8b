"""One rollout of the RoboMaster fleet under any scheme: the symbols that each channel, alone or pooled, gets right."""

import itertools
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import asdict

import numpy as np

from hil.experiments.detectors.bench_recording import ONSET_S, glimpses_of, until
from hil.experiments.detectors.bench_rollout import COHERENCY, MATCHED, plant_of
from hil.experiments.runs.cells import Scalar, Values
from hil.fleet.rig import RunSettings
from hil.plants.mecanum import MecanumParameters
from mtm_audit.detectors.coherency import rate_searched_scores
from mtm_audit.detectors.matched.estimate import estimate, fit_recording_noise
from mtm_audit.detectors.matched.motion import uniform_motion
from mtm_audit.detectors.matched.windows import make_window
from mtm_audit.model.glimpse import Glimpse
from mtm_audit.model.timing import Timing
from mtm_audit.model.track import Floats
from mtm_audit.planning.table import pooled_name
from mtm_onboard.protocol import Codebook, Key, Scheme
from mtm_onboard.protocol.errors import WrongValueError
from mtm_onboard.protocol.framing import channel_symbols
from mtm_onboard.protocol.scheme import scheme_from_table
from mtm_onboard.protocol.schemefile import scheme_text

DETECTORS = (MATCHED, COHERENCY)
WHOLE = "whole message"

# The slowest rate that the paper's detector tries, 0.8 of the true one, looks at 1.25 messages of motion.
_LONGEST_MESSAGE = 1.25
_KEYS_STREAM, _SYMBOLS_STREAM = 3, 4


def rollout_parameters(scheme: Scheme, detector: str, plant: MecanumParameters) -> dict[str, Scalar]:
    """Parameters of a cell for `read_rollout`; raises MtmError when there is no such detector."""
    if detector not in DETECTORS:
        raise WrongValueError(
            f"there is no detector {detector!r} to measure with; choose one of: {', '.join(DETECTORS)}"
        )
    return {"scheme": scheme_text(scheme), "detector": detector, **asdict(plant)}


def read_rollout(parameters: Values, seed: int) -> dict[str, Scalar]:
    """The number of correct symbols by channel name, and whether the `WHOLE` message was correct (1 or 0).

    Each rollout sends random symbols under a key of its own, and its onset is known. Channels with equally many symbols
    are also pooled, as if all had sent the same (a_c and a_I of the paper's "Design Space").
    """
    scheme = scheme_from_table(tomllib.loads(str(parameters["scheme"]))["scheme"])
    key = Key("sweep", np.random.default_rng([_KEYS_STREAM, seed]).bytes(32), scheme)
    drawn = np.random.default_rng([_SYMBOLS_STREAM, seed]).integers(scheme.alphabet_size, size=scheme.message_symbols)
    symbols = tuple(int(symbol) for symbol in drawn)
    message_s = scheme.message_ticks / scheme.rate_hz
    seconds = ONSET_S + _LONGEST_MESSAGE * message_s + 0.1
    longer = glimpses_of(
        RunSettings(
            key=key,
            symbols=symbols,
            seconds=seconds,
            seed=seed,
            wire="direct",
            start_s=ONSET_S,
            plant=plant_of(parameters),
        )
    )
    if parameters["detector"] == MATCHED:
        scores = _matched(key.codebook(), [until(ONSET_S + message_s, glimpse) for glimpse in longer])
    else:
        scores = _coherency(key.codebook(), longer)
    return right_symbols(scheme, scores, channel_symbols(symbols, scheme))


def _matched(codebook: Codebook, glimpses: Sequence[Glimpse]) -> list[Floats]:
    """For each channel (symbols, M): log-likelihood ratios, nats, without knowing the plant, all robots jointly."""
    scheme = codebook.scheme
    timing = Timing(ONSET_S, scheme.rate_hz)
    motions = [uniform_motion(glimpse, scheme.band_hz[1]) for glimpse in glimpses]
    windows = [
        make_window(codebook, channel, motion, timing, robot, window, window)
        for robot, (channel, motion) in enumerate(zip(scheme.channels, motions, strict=True))
        for window in range(channel.symbols)
    ]
    ratios = iter(estimate(windows, motions, fit_recording_noise(motions, [own.velocities for own in motions])).ratios)
    return [np.array([next(ratios) for _ in range(channel.symbols)]) for channel in scheme.channels]


def _coherency(codebook: Codebook, glimpses: Sequence[Glimpse]) -> list[Floats]:
    """For each channel (symbols, M): the paper's coherency scores, window by window."""
    return [
        np.array(
            [
                rate_searched_scores(codebook, channel, glimpse, ONSET_S, window)
                for window in range(channel.symbols)
            ]
        )
        for channel, glimpse in zip(codebook.scheme.channels, glimpses, strict=True)
    ]  # fmt: skip


def right_symbols(scheme: Scheme, scores: Sequence[Floats], sent: Mapping[str, Sequence[int]]) -> dict[str, Scalar]:
    """The number of correct symbols by channel name, and whether the `WHOLE` message is correct (1 or 0).

    `scores` (symbols, M) are of each channel in order, `sent` its symbols by name. Channels with equally many symbols
    are also pooled, as if all had sent the same.
    """
    return _right(
        scheme, [_sent_first(own, sent[name.name]) for own, name in zip(scores, scheme.channels, strict=True)]
    )


def _sent_first(scores: Floats, sent: Sequence[int]) -> Floats:
    """(symbols, M): scores with the candidates of each window rotated so that the symbol sent is number 0.

    Waveforms of different channels and symbols are independent, so it makes no difference which candidates are pooled:
    channels that sent different symbols then decode as if they had sent the same one.
    """
    return np.array([np.roll(row, -symbol) for row, symbol in zip(scores, sent, strict=True)])


def _right(scheme: Scheme, turned: Sequence[Floats]) -> dict[str, Scalar]:
    names = [channel.name for channel in scheme.channels]
    alike = len({channel.symbols for channel in scheme.channels}) == 1
    result: dict[str, Scalar] = {}
    for size in range(1, len(names) + 1 if alike else 2):
        for members in itertools.combinations(range(len(names)), size):
            pooled = np.sum([turned[member] for member in members], axis=0)
            result[pooled_name(names[member] for member in members)] = int(np.sum(np.argmax(pooled, axis=1) == 0))
    carriers = [pooled_name(names)] if scheme.combine == "same" else names
    result[WHOLE] = int(sum(int(result[name]) for name in carriers) == scheme.message_symbols)
    return result
