"""Whether p-values and verdicts hold what they promise under keys that had no part in a recording.

Recordings are few and fixed, keys many and drawn at random: that is what the promise is about. One cell is a recording
with some keys, each decoded as any recording is.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from hil.experiments.runs.cells import Cell, Scalar, Values
from hil.experiments.verdicts.hostile import KINDS, Recording, hostile_recording
from mtm_audit.decoding.decode import decode_tracks
from mtm_audit.decoding.settings import DecodeSettings
from mtm_onboard.protocol import Key, MtmError

LEVELS = (0.1, 0.01, 0.001)
_STREAM, _RECORDING_STREAM = 702, 703
_KEYS_A_CELL = 50


@dataclass(frozen=True, kw_only=True)
class ValiditySummary:
    """Keys on recordings of one kind: `keys` read, `refused` those of which nothing could be read, `below` how many
    p-values are at most each of `LEVELS`, `not_finite` evidence that is no number. `mean_e` is the mean e-value of any
    message with its standard error, `mean_symbol_e` that of the best symbol of a position, divided by the number of
    symbols and 0 where presence is so small that symbols are not weighed; neither should exceed 1.
    """

    kind: str
    keys: int
    refused: int
    decoded: int
    inconclusive: int
    not_finite: int
    below: tuple[int, ...]
    mean_e: float
    mean_e_error: float
    mean_symbol_e: float
    mean_symbol_e_error: float
    most_bits: float


def validity_cells(kind: str, recordings: int, keys: int, first_seed: int) -> list[Cell]:
    """So many recordings of a kind with `keys` keys each."""
    cells = []
    for number in range(recordings):
        for place, first in enumerate(range(0, keys, _KEYS_A_CELL)):
            count = min(_KEYS_A_CELL, keys - first)
            parameters: Values = {"kind": kind, "recording": number, "world": first_seed, "keys": count}
            cells.append(Cell("valid verdicts", parameters, first_seed + place))
    return cells


def decode_under_keys(parameters: Values, seed: int) -> dict[str, Scalar]:
    """Decode a recording under random keys: how many were decoded, how p-values and e-values are spread."""
    kind, number = str(parameters["kind"]), int(parameters["recording"])
    recording = _recording(kind, number, int(parameters["world"]))
    draw = np.random.default_rng([_STREAM, list(KINDS).index(kind), number, seed])
    settings = DecodeSettings(onset_s=recording.onset_s, at=recording.at)
    p_values: list[float] = []
    nats: list[float] = []
    symbol_nats: list[float] = []
    verdicts: list[str] = []
    refused = 0
    for _ in range(int(parameters["keys"])):
        try:
            decoding = decode_tracks(recording.tracks, Key("asked", draw.bytes(32), recording.scheme), settings)
        except MtmError:
            refused += 1
            continue
        p_values.append(decoding.evidence.p_value)
        nats.append(math.nan if decoding.evidence.nats is None else decoding.evidence.nats)
        symbol_nats += [-math.inf if value is None else value for value in decoding.symbol_nats]
        verdicts.append(decoding.verdict)
    finite = np.isfinite(nats)
    e_values = np.exp(np.array(nats)[finite])
    symbol_e_values = np.exp(np.array(symbol_nats)[~np.isnan(symbol_nats)]) / recording.scheme.alphabet_size
    return {
        "keys": len(nats),
        "refused": refused,
        "decoded": verdicts.count("decoded"),
        "inconclusive": verdicts.count("inconclusive"),
        "not_finite": int(np.sum(~finite) + np.sum(np.isnan(symbol_nats) | np.isposinf(symbol_nats))),
        **{f"p <= {level:g}": int(np.sum(np.array(p_values) <= level)) for level in LEVELS},
        "sum_e": float(e_values.sum()),
        "sum_e_squared": float((e_values**2).sum()),
        "symbols": len(symbol_nats),
        "sum_symbol_e": float(symbol_e_values.sum()),
        "sum_symbol_e_squared": float((symbol_e_values**2).sum()),
        "most_nats": max(np.array(nats)[finite].tolist(), default=-math.inf),
    }


def summarise_validity(kind: str, results: Sequence[Values]) -> ValiditySummary:
    """Collect the cells of a kind, or of all."""

    def total(name: str) -> float:
        return float(sum(float(result[name]) for result in results))

    def mean_of(values: str, count: str) -> tuple[float, float]:
        """With its standard error."""
        number = max(total(count), 1.0)
        mean = total(values) / number
        variance = max(total(f"{values}_squared") / number - mean**2, 0.0)
        return mean, math.sqrt(variance / max(number - 1.0, 1.0))

    mean_e, mean_e_error = mean_of("sum_e", "keys")
    mean_symbol_e, mean_symbol_e_error = mean_of("sum_symbol_e", "symbols")
    return ValiditySummary(
        kind=kind,
        keys=int(total("keys")),
        refused=int(total("refused")),
        decoded=int(total("decoded")),
        inconclusive=int(total("inconclusive")),
        not_finite=int(total("not_finite")),
        below=tuple(int(total(f"p <= {level:g}")) for level in LEVELS),
        mean_e=mean_e,
        mean_e_error=mean_e_error,
        mean_symbol_e=mean_symbol_e,
        mean_symbol_e_error=mean_symbol_e_error,
        most_bits=max((float(result["most_nats"]) for result in results), default=-math.inf) / math.log(2.0),
    )


@lru_cache(maxsize=4)
def _recording(kind: str, number: int, world: int) -> Recording:
    return hostile_recording(kind, number, _RECORDING_STREAM + world)
