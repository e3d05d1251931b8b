"""Tracks of simulated robots that send, for the tests of the decoder: the real modulator and chassis, no wire."""

import numpy as np

from hil.plants.mecanum import MecanumPlant, calibrated_parameters
from hil.worlds.robomaster import GoToGoal, routes
from mtm_audit.model.track import Track
from mtm_onboard.model.velocity import BodyVelocity
from mtm_onboard.protocol import Channel, Key, Scheme
from mtm_onboard.runtime.modulator import Modulator

FAKE_SECRET = b"not a real secret, only for test"
OTHER_SECRET = b"one more fake secret, only tests"
NOISE_M = 0.0005


def scheme_of(symbols=(2,), ticks=200, bodies=None, alphabet=4, **changes):
    """One channel a body, on vx and vy; `symbols` are the l_c of the channels, `ticks` the message's length."""
    bodies = bodies or [f"robot{number}" for number in range(len(symbols))]
    channels = tuple(Channel(body, body, ("vx", "vy"), count, 0.1) for body, count in zip(bodies, symbols, strict=True))
    return Scheme(
        name="test",
        rate_hz=50.0,
        band_hz=(0.5, 5.0),
        alphabet_size=alphabet,
        message_ticks=ticks,
        channels=channels,
        **changes,
    )


def key_of(scheme, secret=FAKE_SECRET):
    return Key("fake", secret, scheme)


def robot_track(key, name, symbols, seconds, *, onset_s=0.0, rate_scale=1.0, seed=0, rate_hz=100.0, first_slot=0):
    """Motion capture of one robot that drives the zigzag from the start and sends again and again from `onset_s` on.

    `symbols` are its own, or a message of the runtime's, or None for nothing; a negative onset means it has sent for a
    while. `rate_scale` makes its clock fast.
    """
    scheme = key.scheme
    channel = scheme.channel(name)
    modulator = None if symbols is None else Modulator(key.codebook(first_slot), name, symbols)
    route = routes((0, 1, 2, 3))[seed % 4]
    plant, task = MecanumPlant(calibrated_parameters(), seed, route.start_xy_m), GoToGoal(route)
    period_s = 1.0 / (scheme.rate_hz * rate_scale)
    poses, times_s = [], []
    tick = round(-onset_s / period_s) if onset_s < 0 else 0
    next_tick_s, now_s = max(onset_s, 0.0), 0.0
    while now_s <= seconds + 1e-9:
        plant.step(now_s)
        if now_s + 1e-9 >= next_tick_s or onset_s > now_s:
            base = task.command(plant.position_xy_m, plant.heading_rad)
            if modulator is not None and now_s + 1e-9 >= next_tick_s:
                noise = channel.sigma * modulator.perturbation(tick)
                base = BodyVelocity(base.vx_mps + noise[0], base.vy_mps + noise[1], base.wz_radps)
            if now_s + 1e-9 >= next_tick_s:
                tick += 1
                next_tick_s += period_s
            plant.command(now_s, base)
        poses.append(plant.position_xy_m)
        times_s.append(now_s)
        now_s = len(times_s) * 0.01
    return observed(name, np.array(times_s), np.array(poses), rate_hz, seed)


def observed(name, times_s, positions, rate_hz, seed):
    """What a motion-capture system of that rate makes of it."""
    instants_s = np.arange(int(times_s[-1] * rate_hz + 1e-6) + 1) / rate_hz
    seen = np.stack([np.interp(instants_s, times_s, positions[:, axis]) for axis in range(2)], axis=1)
    seen += NOISE_M * np.random.default_rng(seed).standard_normal(seen.shape)
    return Track(name, instants_s, seen, np.ones(len(instants_s), dtype=bool))
