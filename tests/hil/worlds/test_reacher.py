"""The Reacher world: how its policy drives, what its pictures show, and that its noise is a Gaussian policy's own."""

from dataclasses import replace

import numpy as np
import pytest
from scipy import stats

pytest.importorskip("mujoco")

from hil.sensors.video import write_video
from hil.worlds.noise import keyed_noise
from hil.worlds.reacher import Reacher
from hil.worlds.reacher_policy import trained_policy
from hil.worlds.schemes import single_scheme
from hil.worlds.world import Shot
from mtm_audit.detectors.coherency import rate_searched_scores
from mtm_audit.model.glimpse import glimpse_of_track
from mtm_audit.model.track import Floats, Track
from mtm_audit.readers.video import read_frames
from mtm_onboard.protocol import Codebook, MtmError
from mtm_onboard.protocol.waveform import evaluate

SECRET = b"not a real secret, only for test"
ALMOST_NOTHING = 1e-9


@pytest.fixture(scope="module")
def world() -> Reacher:
    return Reacher()


def keyed_shot(world: Reacher, ticks: int, symbol: int) -> tuple[Codebook, Shot]:
    """The inner arm says one symbol on its way to the target of that number."""
    scheme = single_scheme("reacher", "inner", 8, ticks, 1)
    codebook = Codebook(SECRET, scheme)
    noise = keyed_noise(codebook, [(symbol,)], world.axes).reshape(1, 1, ticks, 2)
    (rollout,) = world.run(np.array([[symbol]]), noise, [3])
    return codebook, rollout.shots[0]


def inner_scores(codebook: Codebook, track: Track) -> Floats:
    inner = replace(track, positions=track.positions[:, :1], axes=("inner",))
    return rate_searched_scores(codebook, codebook.scheme.channels[0], glimpse_of_track(inner), 0.0)


def test_the_mean_action_brings_the_fingertip_to_the_target(world: Reacher) -> None:
    goals = np.arange(8).reshape(8, 1)
    rollouts = world.run(goals, np.full((8, 1, 50, 2), ALMOST_NOTHING), range(8))
    misses_m = [rollout.control.scores["final distance (m)"] for rollout in rollouts]
    assert np.mean(misses_m) < 0.02


def test_a_rollout_is_one_shot_that_begins_where_the_seed_says(world: Reacher) -> None:
    goals = np.array([[2, 7, 2]])
    silent, loud = (world.run(goals, np.full((1, 3, 20, 2), level), [5])[0] for level in (0.0, 1.0))
    (shot,) = silent.shots
    assert shot.times_s == pytest.approx(np.arange(61) / 50)
    assert np.array_equal(shot.states[0], loud.shots[0].states[0])
    assert shot.states[[20, 40, 60], 2:] == pytest.approx(0.14 * np.array([[0, 1], [0.5**0.5, -(0.5**0.5)], [0, 1]]))
    assert np.abs(np.diff(shot.states[:, :2], axis=0)).max() < 0.5
    again = world.run(goals, np.zeros((1, 3, 20, 2)), [5])[0]
    assert np.array_equal(again.shots[0].states, shot.states)


def test_keyed_noise_takes_the_place_of_the_policys_own(world: Reacher) -> None:
    asked = []
    for eps in (1.0, -0.5):
        (rollout,) = world.run(np.array([[0]]), np.full((1, 1, 1, 2), eps), [1])
        asked.append(rollout.control.requested[0] - np.arctanh(rollout.control.base[0]))
        assert rollout.control.applied == pytest.approx(np.tanh(rollout.control.requested))
    assert np.all(asked[0] > 0)
    assert asked[1] == pytest.approx(-0.5 * asked[0])


def test_an_axis_without_keyed_noise_keeps_the_policys_own(world: Reacher) -> None:
    goals = np.zeros((1, 1), dtype=np.int64)
    noise = np.zeros((1, 1, 1, 2))
    (unkeyed,) = world.run(goals, noise, [1])
    noise[..., 0] = 1.0
    (inner_keyed,) = world.run(goals, noise, [1])
    assert unkeyed.control.applied[0, 1] == inner_keyed.control.applied[0, 1] != inner_keyed.control.base[0, 1]
    assert unkeyed.control.applied[0, 0] != inner_keyed.control.applied[0, 0]


def test_the_return_pays_for_distance_and_squared_action(world: Reacher) -> None:
    seeds = range(12)
    still, keyed = (
        world.perform(np.full((12, 50, 2), level), seeds) for level in (ALMOST_NOTHING, 4.0)
    )  # fmt: skip
    returns = np.array([[control.scores["50-step return"] for control in group] for group in (still, keyed)])
    penalties = [0.1 * float(np.square(control.applied).sum()) for control in still]
    assert np.all(returns[0] < np.negative(penalties))
    assert returns[0].mean() > -6
    assert returns[1].mean() < returns[0].mean() - 1


def test_the_software_camera_shows_the_links_directions(world: Reacher) -> None:
    _, shot = keyed_shot(world, 30, 5)
    (track,) = world.tracker().track(world.pictures(shot))
    error_rad = track.positions - np.cumsum(shot.states[:, :2], axis=1)
    error_rad -= 2 * np.pi * np.round(error_rad[0] / (2 * np.pi))
    assert track.axes == ("inner", "outer")
    assert track.valid.mean() > 0.95
    assert np.nanmax(np.abs(error_rad)) < 0.03


def test_mujocos_pictures_and_the_software_cameras_decode_alike(world: Reacher) -> None:
    codebook, shot = keyed_shot(world, 96, 5)
    try:
        native = list(world.native_pictures(shot))
    except MtmError as error:
        pytest.skip(str(error))
    scores = [
        inner_scores(codebook, world.tracker().track(frames)[0]) for frames in (native, world.pictures(shot))
    ]  # fmt: skip
    assert scores[0] == pytest.approx(scores[1], abs=0.02)


def test_without_graphics_mujocos_pictures_say_what_to_install(world: Reacher, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("MUJOCO_GL", "nothing")
    _, shot = keyed_shot(world, 96, 5)
    with pytest.raises(MtmError, match="install OpenGL"):
        next(world.native_pictures(shot))


def test_a_video_file_decodes_as_the_pictures_in_memory(world: Reacher, tmp_path) -> None:
    codebook, shot = keyed_shot(world, 204, 6)
    write_video(world.pictures(shot), tmp_path / "reacher.mp4", world.rate_hz)
    tracks = [
        world.tracker().track(frames)[0]
        for frames in (world.pictures(shot), read_frames(tmp_path / "reacher.mp4", "bgr"))
    ]
    memory, file = (inner_scores(codebook, track) for track in tracks)
    assert memory.argmax() == file.argmax() == 6
    assert file == pytest.approx(memory, abs=0.02)


def test_over_all_keys_actions_have_the_policys_marginal(world: Reacher) -> None:
    scheme = single_scheme("reacher", "inner", 8, 240, 1)
    channel = scheme.channels[0]
    secrets = (number.to_bytes(4) + SECRET[4:] for number in range(10_000))
    books = [Codebook(secret, scheme) for secret in secrets]
    bins, ticks = books[0].bins(channel), np.array([0, 1, 77, 239])
    tones = np.stack([book.tones(channel, 0, [3])[0, 0] for book in books])
    eps = evaluate(tones, bins, 240, ticks)
    for column in eps.T:
        assert stats.kstest(column, "norm").pvalue > 0.01

    state = np.array([[1.0, 0.9, 0.0, 0.4, 0.1, 0.1, 0.5, -0.5, 0.05, 0.02]])
    mean, std = (part[0, 0] for part in trained_policy().distribution(state))
    actions = np.tanh(mean + std * eps[:, 2])
    assert stats.kstest(actions, lambda action: stats.norm.cdf(np.arctanh(action), mean, std)).pvalue > 0.01
