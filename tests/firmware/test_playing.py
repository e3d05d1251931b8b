"""The C core against exact integers and against the floating-point waveform."""

import json
from pathlib import Path

import numpy as np
import pytest

from mtm_onboard.firmware.image import MAX_Q20, ONE, channel_image
from mtm_onboard.protocol import Channel, Codebook, Scheme
from tests.firmware.shim_model import (
    WIDE_LIMITS,
    ShimModel,
    float_noise,
    in_q20,
    largest_unit_q20,
    random_image,
)
from tests.firmware.shim_player import ShimPlayer

_PROTOCOL = Path(__file__).parents[1] / "onboard/protocol"
VECTORS = [
    vector
    for name in ("waveform_v1", "waveform_spectrum_v1")
    for vector in json.loads((_PROTOCOL / f"{name}.json").read_text())
]
KEY_TREE = json.loads((_PROTOCOL / "key_tree_v2.json").read_text())
SECRET = b"not a real secret, only for test"
WIDE = in_q20(WIDE_LIMITS)


def codebook(schedule="fixed", ticks=60, rate_hz=50.0):
    channels = (Channel("robot", "robot", ("vx", "vy"), 2, 0.1),)
    return Codebook(
        SECRET,
        Scheme(
            name="test",
            rate_hz=rate_hz,
            band_hz=(0.5, 5.0),
            alphabet_size=4,
            message_ticks=ticks,
            channels=channels,
            schedule=schedule,
        ),
    )


def message_image(schedule="fixed", *, limits=WIDE_LIMITS, ticks=60, **options):
    return channel_image(codebook(schedule, ticks), "robot", (1, 2), limits=limits, **options)


def reference_image(vector):
    """The image of an independent reference's waveform, whose axis is the channel's last, with sigma 0.1."""
    scheme = Scheme(
        name="reference",
        rate_hz=float(vector["rate_hz"]),
        band_hz=(float(vector["band_hz"][0]), float(vector["band_hz"][1])),
        alphabet_size=512,
        message_ticks=vector["window_ticks"],
        channels=(Channel("robot", "robot", ("vx", "vy", "wz")[: vector["axis"] + 1], 1, 0.1),),
        power=vector["power"],
        schedule="rolling" if vector["window"] else "fixed",
        epoch=vector["epoch"],
        spectrum=tuple((float(hz), float(db)) for hz, db in vector["spectrum"]) if "spectrum" in vector else None,
    )
    book = Codebook(bytes.fromhex(vector["key_hex"]), scheme)
    return channel_image(book, "robot", (vector["symbol"],), limits=WIDE_LIMITS, first_message=vector["window"])


def vector_name(vector):
    shape = "spectrum" if "spectrum" in vector else "flat"
    return f"n{vector['window_ticks']}-{vector['symbol']}-{vector['power']}-{shape}"


def pair(image, **settings):
    players = ShimModel(image.rate_mhz, WIDE, **settings), ShimPlayer(image.rate_mhz, WIDE, **settings)
    for player in players:
        player.offer(image)
    return players


def test_output_is_within_one_bit_of_floating_point():
    rng = np.random.default_rng(5)
    worst = 0.0
    for _ in range(1000):
        book, channel, message, image = random_image(rng)
        noise = float_noise(book, channel, message, image)
        bases = rng.uniform(-1, 1, noise.shape) * rng.choice([0.1, 1, 5])
        limit = image.limits_q20[0] / ONE
        expected = np.clip(np.clip(bases, -limit, limit) + noise, -limit, limit) * ONE
        player = ShimPlayer(image.rate_mhz, [MAX_Q20] * 3, 9_999, 10_000)
        assert player.offer(image) == 0
        bases_q20 = np.rint(bases * ONE).astype(int).tolist()
        times_us = [tick * 10**9 // image.rate_mhz for tick in range(len(noise))]
        played = [player.tick(now_us, base) for now_us, base in zip(times_us, bases_q20, strict=True)]
        errors = np.abs(np.array(played) - expected) / largest_unit_q20(image)
        worst = max(worst, float(errors.max()))
    assert 0.3 < worst <= 1.0


@pytest.mark.parametrize("vector", VECTORS, ids=vector_name)
def test_the_reference_waveforms_are_played_to_the_stated_bound(vector):
    axis, sigma = vector["axis"], 0.1
    image = reference_image(vector)
    player = ShimPlayer(image.rate_mhz, WIDE, 9_999, 10_000)
    assert player.offer(image) == 0
    played = [player.tick(tick * 10**9 // image.rate_mhz, (0, 0, 0))[axis] for tick in range(vector["window_ticks"])]
    expected = sigma * np.array(vector["samples"], float) * ONE
    bound_q20 = image.steps[axis] / (1 << 17) + 0.5
    assert np.max(np.abs(np.array(played) - expected)) <= bound_q20 + 1e-6
    assert bound_q20 / ONE / sigma < 1e-4


def test_a_channel_of_the_key_tree_is_played_to_the_stated_bound():
    vector = KEY_TREE["waveform"]
    secret = bytes.fromhex(KEY_TREE["days"][2]["channels"][1])
    scheme = Scheme(
        name="reference",
        rate_hz=float(vector["rate_hz"]),
        band_hz=tuple(map(float, vector["band_hz"])),
        alphabet_size=4,
        message_ticks=vector["ticks"],
        channels=(Channel("robot", "robot", ("vx", "vy", "wz"), 1, 0.1),),
        schedule="rolling",
        epoch=vector["day"],
    )
    image = channel_image(
        Codebook(secret, scheme), "robot", (vector["symbol"],), limits=WIDE_LIMITS, first_message=vector["window"]
    )
    player = ShimPlayer(image.rate_mhz, WIDE, 9_999, 10_000)
    assert player.offer(image) == 0
    played = [player.tick(tick * 20_000, (0, 0, 0))[vector["axis"]] for tick in range(vector["ticks"])]
    expected = 0.1 * np.array(vector["samples"], float) * ONE
    assert np.max(np.abs(np.array(played) - expected)) <= image.steps[2] / (1 << 17) + 0.5 + 1e-6


@pytest.mark.parametrize("seed", range(20))
def test_the_shim_does_what_the_header_says_at_random_times(seed):
    rng = np.random.default_rng(seed)
    _, _, _, image = random_image(rng, 60)
    _, _, _, following = random_image(rng, 60)
    following = following.__class__(**{**following.__dict__, "rate_mhz": image.rate_mhz})
    model, player = pair(image)
    period_us = 10**9 / image.rate_mhz
    now_us = int(rng.integers(1 << 33))
    for step in range(300):
        if step == 150:
            model.offer(following)
            assert player.offer(following) == 0
        now_us += int(rng.exponential(rng.choice([0.2, 1.0, 20.0]) * period_us))
        base = None if rng.random() < 0.5 else rng.integers(-40 * ONE, 40 * ONE, 3).tolist()
        assert player.tick(now_us, base) == model.tick(now_us, base), step
    assert player.counts.base_clamps + player.counts.output_clamps == model.clamps


def test_missed_ticks_shift_nothing():
    image = message_image()
    _, steady = pair(image)
    _, lossy = pair(image)
    played = [steady.tick(20_000 * tick, (0, 0, 0)) for tick in range(200)]
    heard = [0, 1, 2, 9, 10, 58, 61, 119, 121, 180, 199]
    assert [lossy.tick(20_000 * tick, (0, 0, 0)) for tick in heard] == [played[tick] for tick in heard]
    assert lossy.counts.missed_ticks == 199 - (len(heard) - 1)


def test_jitter_below_half_a_period_plays_every_sample_once():
    rng = np.random.default_rng(1)
    image = message_image()
    _, steady = pair(image)
    _, shaky = pair(image)
    for tick in range(200):
        late_us = int(rng.integers(-9_900, 9_900)) if tick else 0
        assert shaky.tick(1_000_000 + 20_000 * tick + late_us, (0, 0, 0)) == steady.tick(20_000 * tick, (0, 0, 0))
    assert shaky.counts.missed_ticks == 0


def test_the_timer_may_wrap():
    image = message_image()
    _, plain = pair(image)
    _, wrapping = pair(image)
    for tick in range(300):
        now_us = 20_000 * tick
        assert wrapping.tick(2**32 - 1_000_000 + now_us, (5, 6, 7)) == plain.tick(now_us, (5, 6, 7))


def test_a_timer_that_runs_backwards_moves_nothing():
    _, player = pair(message_image())
    before = player.tick(1_000_000, (0, 0, 0))
    assert player.tick(999_000, (0, 0, 0)) == before
    assert player.counts.clock_faults == 1


def test_the_second_image_begins_where_the_first_message_ends():
    first, second = message_image("rolling"), message_image("rolling", first_message=1)
    both = message_image("rolling", messages=2)
    player = ShimPlayer(first.rate_mhz, WIDE)
    assert player.offer(first) == 0
    player.tick(0, (0, 0, 0))
    assert player.offer(second) == 0
    assert player.offer(second) == player.lib.MTM_IMAGE_BUSY
    _, whole = pair(both)
    whole.tick(0, (0, 0, 0))
    unit = max(*largest_unit_q20(first), *largest_unit_q20(both)) + 1
    for tick in range(1, 120):
        difference = np.subtract(player.tick(20_000 * tick, (0, 0, 0)), whole.tick(20_000 * tick, (0, 0, 0)))
        assert np.max(np.abs(difference)) <= unit
    assert player.tick(20_000 * 120, (9, 9, 9)) == [9, 9, 9]
    assert player.counts.ended_images == 1


def test_a_repeating_image_gives_way_at_its_next_boundary():
    first, second = message_image(), channel_image(codebook(), "robot", (3, 0), limits=WIDE_LIMITS)
    model, player = pair(first)
    for tick in range(200):
        if tick == 70:
            model.offer(second)
            assert player.offer(second) == 0
        assert player.tick(20_000 * tick, (0, 0, 0)) == model.tick(20_000 * tick, (0, 0, 0))
    assert player.shim.pending.bytes == player.ffi.NULL


def test_silence_ends_the_noise_and_leaves_the_command():
    _, player = pair(message_image())
    assert player.tick(0, (100, 200, 300)) != [100, 200, 300]
    player.lib.mtm_shim_silence(player.shim)
    assert player.tick(20_000, (100, 200, 300)) == [100, 200, 300]


def test_without_an_image_a_command_passes_as_it_is():
    player = ShimPlayer(50_000, WIDE)
    assert player.tick(0, (1, -2, 3)) == [1, -2, 3]


def test_the_smaller_of_two_limits_holds():
    image = message_image(limits=(0.5, 30.0, 30.0))
    player = ShimPlayer(image.rate_mhz, in_q20((10, 0.25, 10)))
    player.offer(image)
    out = player.tick(0, in_q20((9, -9, 9)))
    assert out[0] <= in_q20([0.5])[0]
    assert out[1] >= -in_q20([0.25])[0]
    assert out[2] == 9 * ONE
    assert player.counts.base_clamps == 2
