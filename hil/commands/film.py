"""`mtm-hil film`: one rollout of a simulated world as a video, for an auditor."""

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import Progress

from hil.commands.new_folder import check_new, new_folder
from hil.experiments.worlds.points import SAME, headline_point
from hil.experiments.worlds.rollout import NATIVE
from hil.sensors.video import write_video
from hil.worlds.noise import keyed_noise
from hil.worlds.registry import make_world
from hil.worlds.world import Rollout, World, check_axes
from mtm_audit.model.picture import Frame
from mtm_audit.model.track import Floats
from mtm_onboard.protocol import Key, MtmError, generate_key, load_key, save_key
from mtm_onboard.protocol.framing import symbols_of_number

KEY_NAME = "robot.key"
# What `mtm-audit decode` needs to be told about each world's pictures.
TRACKERS = {
    "discovery": "centroid:#4040bf",
    "lunar-lander": "brightness:0,0,600,200",
    "reacher": "arms",
    "football": "football",
}


@dataclass(frozen=True, kw_only=True)
class FilmOptions:
    """What the command line asked for; `message` None moves without one, `key` None makes a key."""

    world: str
    out: Path
    seconds: float
    message: int | None
    key: Path | None
    seed: int
    renderer: str


def film(options: FilmOptions, console: Console) -> None:
    """Write video and key into a new folder, whole or not at all.

    Raises MtmError when the folder exists, the simulator is missing, or the key's scheme is not for this world.
    """
    check_new(options.out)
    world = make_world(options.world)
    scheme = headline_point(options.world).of_arrangement(SAME).scheme
    key = generate_key(options.world, scheme) if options.key is None else load_key(options.key)
    rollout = _rollout(world, key, options)
    with new_folder(options.out) as folder:
        if options.key is None:
            save_key(key, folder / KEY_NAME)
        with Progress(console=console, transient=True, disable=not console.is_terminal) as progress:
            task = progress.add_task("filming", total=len(rollout.shots[0].times_s))
            frames = _counted(_pictures(world, rollout, options), lambda: progress.advance(task))
            count = write_video(frames, folder / "video.mp4", world.rate_hz)
        truth = {"world": options.world, "message": options.message, "scheme_fingerprint": key.scheme.fingerprint}
        (folder / "truth.json").write_text(json.dumps(truth | {"seed": options.seed}, indent=2) + "\n")
    sent = "no message" if options.message is None else f"message {options.message} repeated from the start"
    print(f"{options.out}: {count} frames, {sent}")
    print(f"decode it with --tracker {TRACKERS[options.world]}")
    if options.key is None:
        print(f"the key is {options.out / KEY_NAME}; keep it secret")


def _rollout(world: World, key: Key, options: FilmOptions) -> Rollout:
    """One rollout in one shot, its goals drawn from the seed."""
    scheme = key.scheme
    if scheme.schedule != "fixed" or scheme.framing is not None or scheme.rate_hz != world.rate_hz:
        raise MtmError(
            f"the key's scheme cannot be played in {world.name}; choose one of {world.rate_hz:g} Hz with a fixed "
            "schedule and plain numbers as messages"
        )
    check_axes(world, scheme)
    # Each of the lander's goals would be a film of its own.
    goals = 1 if world.name == "lunar-lander" else world.goals
    ticks = max(1, round(options.seconds * world.rate_hz / goals))
    noise: Floats = np.zeros((goals * ticks, len(world.axes)))
    if options.message is not None:
        times = -(-len(noise) // scheme.message_ticks)
        symbols = symbols_of_number(options.message, scheme)
        noise = keyed_noise(key.codebook(), [symbols] * times, world.axes)[: len(noise)]
    drawn = np.random.default_rng(options.seed).permutation(world.choices)[:goals]
    (rollout,) = world.run(drawn[None], noise.reshape(1, goals, ticks, -1), [options.seed])
    return rollout


def _pictures(world: World, rollout: Rollout, options: FilmOptions) -> Iterator[Frame]:
    (shot,) = rollout.shots
    pictures = world.native_pictures(shot) if options.renderer == NATIVE else world.pictures(shot)
    for frame in pictures:
        yield Frame(frame.time_s - float(shot.times_s[0]), frame.image)


def _counted(frames: Iterator[Frame], filmed: Callable[[], None]) -> Iterator[Frame]:
    for frame in frames:
        yield frame
        filmed()
