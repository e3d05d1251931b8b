"""How often a verdict is `decoded` and the message wrong, on vehicles that no detector was tuned on.

One cell is one message. Alphabet, windows, law of the waveforms, loudness, clock, how often the message is played, and
how much of it the recording shows are drawn from the cell's seed, so that much of it lies where evidence is scarce.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from hil.experiments.runs.cells import Cell, Scalar, Values
from hil.experiments.verdicts.thresholds import THRESHOLDS, decode_at
from hil.fleet.driven import sent_track
from hil.fleet.sending import Sending
from hil.worlds.vehicles import VEHICLES, Vehicle
from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.model.track import Track
from mtm_onboard.protocol import Channel, Key, MtmError, Scheme
from mtm_onboard.protocol.framing import number_of_symbols
from mtm_onboard.protocol.scheme import Power

FLEETS = "fleets, exchanged or silent"
PLANTS = (*VEHICLES, FLEETS)

_STREAM = 701
_ROBOTS = 3
# What is wrong with a fleet: tracks under each other's names, a robot without a message, both, or two robots that play
# the waveforms of one.
FAULTS = ("exchanged", "silent", "exchanged and silent", "one channel twice")
_SIGMA = 0.1


@dataclass(frozen=True, kw_only=True)
class SureSummary:
    """One plant at one threshold, in messages.

    `wrong` and `right` are those `decoded`, `likeliest_absent` those absent although the likeliest symbols are the
    message's, `refused` those of which nothing could be read.
    """

    plant: str
    threshold: float
    messages: int
    wrong: int
    right: int
    inconclusive: int
    absent: int
    likeliest_absent: int
    refused: int


@dataclass(frozen=True, kw_only=True)
class _Job:
    """A recording: its scheme's sizes, how loud and how often the message is played, and what is known of its start."""

    scheme: Scheme
    sigma: float
    messages: int
    onset_s: float
    seconds: float
    rate_scale: float
    onset_known: bool


def sure_cells(plant: str, messages: int, first_seed: int) -> list[Cell]:
    """One cell for each message on one plant."""
    return [Cell("sure verdicts", {"plant": plant}, first_seed + row) for row in range(messages)]


def decode_sent(parameters: Values, seed: int) -> dict[str, Scalar]:
    """Send one message and decode it: the verdict at each threshold, and whether it is right."""
    plant = str(parameters["plant"])
    draw = np.random.default_rng([_STREAM, PLANTS.index(plant), seed])
    key, job, tracks, sent = _fleet(draw) if plant == FLEETS else _single(VEHICLES[plant], draw)
    settings = DecodeSettings(onset_s=job.onset_s if job.onset_known else None)
    try:
        decodings = decode_at(tracks, key, settings)
    except MtmError:
        return {**{f"verdict {threshold:g}": "refused" for threshold in THRESHOLDS}, "likeliest_right": False}
    result: dict[str, Scalar] = {"likeliest_right": decodings[-1].symbols == sent}
    for threshold, decoding in zip(THRESHOLDS, decodings, strict=True):
        result[f"verdict {threshold:g}"] = decoding.verdict
        if decoding.verdict == "decoded":
            # A robot that sent nothing has no right symbol.
            symbols = [symbol for symbol in sent if symbol is not None]
            right = len(symbols) == len(sent) and decoding.message == number_of_symbols(symbols, key.scheme)
            result[f"right {threshold:g}"] = right
    return result


def summarise_sure(plant: str, results: Sequence[Values]) -> list[SureSummary]:
    """Collect a plant's messages at each threshold."""
    return [_summary(plant, results, threshold) for threshold in THRESHOLDS]


def _summary(plant: str, results: Sequence[Values], threshold: float) -> SureSummary:
    verdicts = [str(result[f"verdict {threshold:g}"]) for result in results]
    right = [result.get(f"right {threshold:g}") for result in results]
    absent_right = sum(
        verdict == "absent" and bool(result["likeliest_right"])
        for verdict, result in zip(verdicts, results, strict=True)
    )
    return SureSummary(
        plant=plant,
        threshold=threshold,
        messages=len(results),
        wrong=right.count(False),
        right=right.count(True),
        inconclusive=verdicts.count("inconclusive"),
        absent=verdicts.count("absent"),
        likeliest_absent=absent_right,
        refused=verdicts.count("refused"),
    )


def _single(vehicle: Vehicle, draw: np.random.Generator) -> tuple[Key, _Job, list[Track], tuple[int | None, ...]]:
    """One vehicle that sends a message of one to four symbols."""
    windows, ticks = int(draw.choice((1, 2, 4))), int(draw.choice((100, 200, 300)))
    scheme = _scheme((Channel("robot", "robot", vehicle.kind.axes, windows, _SIGMA),), windows * ticks, draw)
    job = _job(scheme, draw)
    key = Key("sent", draw.bytes(32), scheme)
    symbols = _symbols(scheme, windows, draw)
    return key, job, [_recorded(key, job, vehicle, [("robot", symbols)], "robot", draw)], symbols


def _fleet(draw: np.random.Generator) -> tuple[Key, _Job, list[Track], tuple[int | None, ...]]:
    """Three vehicles with a symbol each, and something wrong among them."""
    names = [f"robot{number}" for number in range(_ROBOTS)]
    channels = tuple(Channel(name, name, ("vx", "vy"), 1, _SIGMA) for name in names)
    scheme = _scheme(channels, int(draw.choice((150, 200, 300))), draw)
    job = _job(scheme, draw)
    key = Key("sent", draw.bytes(32), scheme)
    symbols = _symbols(scheme, _ROBOTS, draw)
    fault, one = str(draw.choice(FAULTS)), int(draw.integers(_ROBOTS))
    other = (one + 1) % _ROBOTS
    usual = [vehicle for vehicle in VEHICLES.values() if vehicle.kind.axes == ("vx", "vy")]
    vehicle = usual[int(draw.integers(len(usual)))]
    plays = [[(name, (symbols[row],))] for row, name in enumerate(names)]
    sent: list[int | None] = list(symbols)
    if "silent" in fault:
        plays[one], sent[one] = [], None
    if fault == "one channel twice":
        plays[one], sent[one] = plays[other], None
    tracks = [_recorded(key, job, vehicle, play, name, draw) for play, name in zip(plays, names, strict=True)]
    if "exchanged" in fault:
        last = (one + 2) % _ROBOTS
        tracks[other], tracks[last] = (
            replace(tracks[last], name=names[other]),
            replace(tracks[other], name=names[last]),
        )
    return key, job, tracks, tuple(sent)


def _scheme(channels: tuple[Channel, ...], ticks: int, draw: np.random.Generator) -> Scheme:
    power: Power = "ensemble" if draw.random() < 0.25 else "window"
    return Scheme(
        name="sure",
        rate_hz=50.0,
        band_hz=(0.5, 5.0),
        alphabet_size=int(draw.choice((4, 16, 64, 256))),
        message_ticks=ticks,
        channels=channels,
        power=power,
    )


def _job(scheme: Scheme, draw: np.random.Generator) -> _Job:
    """Half of the messages are played again and again, of which half had begun before the recording."""
    message_s = scheme.message_ticks / scheme.rate_hz
    again = bool(draw.random() < 0.5)
    begun = again and bool(draw.random() < 0.5)
    onset_s = float(np.round(draw.uniform(-message_s, 0.0) if begun else draw.uniform(0.2, 2.0), 2))
    seconds = onset_s + message_s * float(draw.uniform(1.0, 2.5) if again else 1.0) + float(draw.uniform(0.1, 1.5))
    return _Job(
        scheme=scheme,
        sigma=_SIGMA * float(2.0 ** draw.uniform(-0.5, 1.5)),
        messages=100 if again else 1,
        onset_s=onset_s,
        seconds=max(seconds, 1.05 * message_s),
        rate_scale=float(draw.choice((1.0, 1.0, 1.001, 0.99))),
        onset_known=bool(draw.random() < 0.5),
    )


def _symbols(scheme: Scheme, count: int, draw: np.random.Generator) -> tuple[int, ...]:
    return tuple(int(symbol) for symbol in draw.integers(0, scheme.alphabet_size, count))


def _recorded(
    key: Key, job: _Job, vehicle: Vehicle, plays: Sequence[tuple[str, tuple[int, ...]]], name: str,
    draw: np.random.Generator,
) -> Track:  # fmt: skip
    """The track of one vehicle that plays its symbols of the named channels."""
    codebook = key.codebook()
    sendings = [
        Sending(
            codebook=codebook, channel=job.scheme.channel(channel), symbols=symbols, onset_s=job.onset_s,
            messages=job.messages, sigma=job.sigma, rate_scale=job.rate_scale,
        )
        for channel, symbols in plays
    ]  # fmt: skip
    return sent_track(name, vehicle, sendings, job.seconds, draw)
