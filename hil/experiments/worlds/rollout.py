"""A batch of rollouts of a simulated world under the onboard modulator's noise, filmed, tracked and decoded."""

import json
import tempfile
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np

from hil.experiments.runs.cells import Scalar, Values
from hil.experiments.worlds.genie import GENIE, GenieModel, fit_genie, genie_scores, known_shots
from hil.experiments.worlds.points import Point, headline_point, point_of
from hil.experiments.worlds.reading import ObservedShot, pooled_scores, read_windows
from hil.sensors.video import write_video
from hil.worlds.noise import keyed_noise
from hil.worlds.registry import make_world
from hil.worlds.world import Integers, Rollout, Shot, World
from mtm_audit.decoding.assignment import assign_tracks
from mtm_audit.detectors.coherency import own_axes
from mtm_audit.model.glimpse import glimpse_of_track
from mtm_audit.model.picture import Frame
from mtm_audit.model.track import Floats
from mtm_audit.readers.video import read_frames
from mtm_onboard.protocol import Codebook, Scheme

SENT, NO_MESSAGE = "message", "no message"
MEMORY, FILE = "memory", "file"
SOFTWARE, NATIVE = "software", "native"
SECONDS = "seconds"

# Rollouts that the genie is fitted to; their seeds count from 0, far from any that is reported.
_TRAINING_ROLLOUTS = {"discovery": 8, "lunar-lander": 6, "reacher": 6, "football": 12}
_KEYS_STREAM, _GOALS_STREAM = 5, 6


def rollout_parameters(
    point: Point,
    batch: int,
    detectors: Sequence[str],
    *,
    arm: str = SENT,
    decoys: int = 0,
    parts: Sequence[str] = (),
    renderer: str = SOFTWARE,
    medium: str = MEMORY,
) -> dict[str, Scalar]:
    """Parameters of a cell for `decode_batch`: `batch` rollouts from the cell's seed on.

    `parts` names the first channel when a "same" arrangement is decoded from that alone as well, `decoys` is how many
    wrong keys try each rollout, and `medium` says whether the pictures stay in memory or go through a video file.
    """
    return {
        **point.parameters(), "batch": batch, "detectors": "+".join(detectors), "arm": arm, "decoys": decoys,
        "parts": "+".join(parts), "renderer": renderer, "medium": medium,
    }  # fmt: skip


def decode_batch(parameters: Values, seed: int) -> dict[str, Scalar]:
    """Run, film and decode the rollouts of `seed` and those after it.

    Result: for each detector and each decoded arrangement, under `<detector> <arrangement> <what>`, a JSON list with a
    number for each rollout: `goals` and `symbols` right, the mean `margin` between best and second-best score, and
    where wrong keys were tried `wrong`, the symbols that those had right. `seconds` is the processor time it took.
    """
    started_s = time.process_time()
    point = point_of(parameters)
    keys = [np.random.default_rng([_KEYS_STREAM, own]) for own in range(seed, seed + int(parameters["batch"]))]
    secrets = [[key.bytes(32) for _ in range(1 + int(parameters["decoys"]))] for key in keys]
    recorded = record(
        point, [first for first, *_ in secrets], seed, keyed=parameters["arm"] == SENT,
        renderer=str(parameters["renderer"]), medium=str(parameters["medium"]),
    )  # fmt: skip
    arrangements = [point.arrangement, *(part for part in str(parameters["parts"]).split("+") if part)]
    results: dict[str, list[float]] = {}
    for (seen, symbols), own in zip(recorded, secrets, strict=True):
        for detector in str(parameters["detectors"]).split("+"):
            for arrangement in arrangements if detector != GENIE else arrangements[:1]:
                part = point.of_arrangement(arrangement)
                looked_at = seen if part == point else _narrowed(seen, part.scheme)
                tried = own if part == point else own[:1]
                for name, value in _decoded(part, tried, looked_at, symbols, detector):
                    results.setdefault(f"{detector} {arrangement} {name}", []).append(value)
    lists = {name: json.dumps(values) for name, values in results.items()}
    return {**lists, SECONDS: time.process_time() - started_s}


def record(
    point: Point,
    secrets: Sequence[bytes],
    seed: int,
    *,
    keyed: bool = True,
    renderer: str = SOFTWARE,
    medium: str = MEMORY,
) -> Iterator[tuple[list[ObservedShot], list[tuple[int, ...]]]]:
    """Yield, for each secret, one rollout's observed shots and the symbols of each of its messages.

    The rollouts have `seed` and the seeds after it; without `keyed` nothing is sent.
    """
    world = make_world(point.world)
    seeds = range(seed, seed + len(secrets))
    goals = np.array([_goals(world, point, own) for own in seeds])
    messages = [_messages(world, point, own, number) for own, number in zip(goals, seeds, strict=True)]
    shape = len(secrets), point.goals, point.goal_ticks, len(world.axes)
    noise: Floats = np.zeros(shape)
    if keyed:
        codebooks = [Codebook(secret, point.scheme) for secret in secrets]
        sent = [keyed_noise(book, own, world.axes) for book, own in zip(codebooks, messages, strict=True)]
        noise = np.stack(sent).reshape(shape)
    for rollout, own in zip(world.run(goals, noise, seeds), messages, strict=True):
        yield film_and_track(world, rollout, point.scheme, renderer, medium), own


@cache
def _genie_model(world: str) -> GenieModel:
    """The genie's model of a world, fitted to rollouts of the headline point on which nothing is measured."""
    point = headline_point(world)
    secrets = [np.random.default_rng([_KEYS_STREAM, own]).bytes(32) for own in range(_TRAINING_ROLLOUTS[world])]
    examples = [
        example
        for (seen, symbols), secret in zip(record(point, secrets, 0), secrets, strict=True)
        for channel in known_shots(Codebook(secret, point.scheme), seen, symbols)
        for example in channel
    ]
    return fit_genie(examples)


def film_and_track(
    world: World, rollout: Rollout, scheme: Scheme, renderer: str = SOFTWARE, medium: str = MEMORY
) -> list[ObservedShot]:
    """What is observed of each shot, filmed and tracked; raises MtmError when a body is not found in one."""
    seen = []
    for shot in rollout.shots:
        pictures = world.native_pictures(shot) if renderer == NATIVE else world.pictures(shot)
        tracks = world.tracker().track(pictures if medium == MEMORY else _through_a_file(pictures, shot, world.rate_hz))
        glimpses = {name: glimpse_of_track(track) for name, track in assign_tracks(scheme, tracks).settled.items()}
        ticks = range(shot.first_tick, shot.first_tick + len(shot.times_s) - 1)
        seen.append(ObservedShot(float(shot.times_s[0]), ticks, glimpses))
    return seen


def _through_a_file(pictures: Iterator[Frame], shot: Shot, rate_hz: float) -> Iterator[Frame]:
    """The same frames written as H.264 and read again; the file's clock starts with the shot."""
    start_s = float(shot.times_s[0])
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "shot.mp4"
        write_video((Frame(frame.time_s - start_s, frame.image) for frame in pictures), path, rate_hz)
        for frame in read_frames(path, "bgr"):
            yield Frame(frame.time_s + start_s, frame.image)


def _goals(world: World, point: Point, seed: int) -> Integers:
    """The goals of a rollout: all of the world's in random order, or a part that moves on from rollout to rollout."""
    if point.goals == world.choices:
        return np.random.default_rng([_GOALS_STREAM, seed]).permutation(world.choices)
    return (seed + np.arange(point.goals)) % world.choices


def _messages(world: World, point: Point, goals: Integers, seed: int) -> list[tuple[int, ...]]:
    """All symbols of each message: the goals' digits, or random symbols where there are more than the goals need."""
    size, digits = point.alphabet_size, point.goal_symbols
    spelled = [tuple(int(goal) // size**place % size for place in reversed(range(digits))) for goal in goals]
    if size ** (digits - 1) >= world.choices:
        drawn = np.random.default_rng([_GOALS_STREAM, seed, 1]).integers(size, size=(point.goals, digits))
        spelled = [tuple(int(symbol) for symbol in row) for row in drawn]
    return [tuple(symbol for own in spelled for symbol in own)] if point.whole else spelled


def _narrowed(seen: Sequence[ObservedShot], scheme: Scheme) -> Sequence[ObservedShot]:
    """The same shots with the axes of the scheme's one channel only."""
    (channel,) = scheme.channels
    return [replace(one, glimpses={channel.body: own_axes(channel, one.glimpses[channel.body])}) for one in seen]


def _decoded(
    point: Point, secrets: Sequence[bytes], seen: Sequence[ObservedShot], sent: Sequence[Sequence[int]], detector: str
) -> Iterator[tuple[str, float]]:
    """Names and values of one rollout's results under one detector; the first of the secrets is the right one."""
    truth = np.concatenate([np.asarray(symbols) for symbols in sent])
    if detector == GENIE:
        scores, others = _genie_scores(Codebook(secrets[0], point.scheme), point, seen, sent), []
    else:
        scores, *others = [_message_scores(Codebook(secret, point.scheme), point, seen, detector) for secret in secrets]
    right = np.argmax(scores, axis=1) == truth
    best = np.sort(scores, axis=1)
    yield "goals", float(right.reshape(-1, point.goal_symbols).all(axis=1).sum())
    yield "symbols", float(right.sum())
    yield "margin", float(np.mean(best[:, -1] - best[:, -2]))
    if others:
        yield "wrong", float(sum((np.argmax(other, axis=1) == truth).sum() for other in others))


def _genie_scores(
    codebook: Codebook, point: Point, seen: Sequence[ObservedShot], sent: Sequence[Sequence[int]]
) -> Floats:
    """Log-likelihoods (symbols, M) of a single or "same" arrangement, all channels together."""
    model = _genie_model(point.world)
    channels = zip(codebook.scheme.channels, known_shots(codebook, seen, sent), strict=True)
    return pooled_scores([genie_scores(model, codebook, own, seen, channel) for channel, own in channels], GENIE)


def _message_scores(codebook: Codebook, point: Point, seen: Sequence[ObservedShot], detector: str) -> Floats:
    """Scores (symbols, M) in the order of the messages' symbols, from those of each channel's windows."""
    scheme = codebook.scheme
    channels = read_windows(codebook, seen, point.messages, detector)
    if scheme.combine == "same":
        return pooled_scores(channels, detector)
    of_messages = [
        scores.reshape(point.messages, channel.symbols, -1)
        for channel, scores in zip(scheme.channels, channels, strict=True)
    ]
    joined = np.concatenate(of_messages, axis=1)
    return np.asarray(joined.reshape(-1, joined.shape[2]))
