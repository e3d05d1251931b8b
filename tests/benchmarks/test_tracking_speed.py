"""How much faster than real time recordings are made and read, on one core.

Processor time is what is measured, of all threads together: it is the time one core would take, whatever else runs.
"""

import time

import cv2
import numpy as np
import pytest

from hil.sensors.camera import Camera, film
from hil.sensors.optics import overhead
from hil.sensors.poses import Trajectory
from hil.sensors.scene import Scene
from hil.sensors.video import write_video
from mtm_audit.ingest.load import load_tracks
from mtm_audit.live.films import FilmSource
from mtm_audit.live.watching import Film
from mtm_audit.model.picture import Frame
from mtm_audit.readers.video import read_frames
from mtm_audit.tracking.following import following
from mtm_audit.tracking.registry import tracker

pytestmark = pytest.mark.benchmark(timer=time.process_time)
SECONDS = 5.0
COLOURS_BGR = ((255, 255, 0), (255, 0, 255), (0, 230, 230), (30, 30, 230))


@pytest.fixture(autouse=True)
def one_thread():
    threads = cv2.getNumThreads()
    cv2.setNumThreads(1)
    yield
    cv2.setNumThreads(threads)


def four_robots():
    times_s = np.arange(round(SECONDS * 200) + 1) / 200
    robots = []
    for number in range(4):
        angles = np.pi / 2 * number + 0.5 * times_s
        positions = np.stack([1.3 * np.cos(angles), 1.1 * np.sin(angles)], axis=1)
        robots.append(Trajectory(f"robot{number}", times_s, positions, angles))
    return robots


def record(path, scene):
    write_video(film(Camera(blur_px=0.5), scene, four_robots(), np.random.default_rng(1)), path)


def times_real_time(benchmark, label):
    """Print and return the ratio; without benchmarks switched on nothing was timed and the ratio is unknown."""
    if not benchmark.enabled:
        return None
    ratio = SECONDS / benchmark.stats.stats.min
    benchmark.extra_info["times_real_time"] = round(ratio, 1)
    print(f"\n{label}: {ratio:.1f} times real time at 704 x 704, 30 Hz, four robots")
    return ratio


@pytest.mark.parametrize(
    ("name", "scene"),
    [("aruco", Scene()), ("colour:cyan,magenta,yellow,red", Scene(colours_bgr=COLOURS_BGR))],
    ids=["aruco", "colour"],
)
def test_tracking_a_video_takes_at_most_half_its_length(tmp_path, benchmark, name, scene):
    record(tmp_path / "film.mp4", scene)
    tracks = benchmark.pedantic(load_tracks, args=(tmp_path / "film.mp4", name), rounds=3)
    assert [track.valid.all() for track in tracks] == [True] * 4
    ratio = times_real_time(benchmark, name)
    assert ratio is None or ratio >= 2


def seconds_of_processor(work):
    start_s = time.process_time()
    work()
    return time.process_time() - start_s


@pytest.mark.slow
def test_tracking_1080p60_costs_little_beside_decoding(tmp_path, benchmark):
    camera = Camera(optics=overhead(width_px=1920, height_px=1080), rate_hz=60.0, blur_px=0.8, noise_levels=1.0)
    frames = film(camera, Scene(), four_robots(), np.random.default_rng(1), 0.0, 3.0)
    write_video(frames, tmp_path / "film.mp4", 60.0)
    decoding_s = min(seconds_of_processor(lambda: list(map(id, read_frames(tmp_path / "film.mp4")))) for _ in range(3))
    tracks = benchmark.pedantic(load_tracks, args=(tmp_path / "film.mp4", "aruco"), rounds=3)
    assert [track.valid.all() for track in tracks] == [True] * 4
    if benchmark.enabled:
        ratio = benchmark.stats.stats.min / decoding_s
        benchmark.extra_info["times_bare_decoding"] = round(ratio, 2)
        print(f"\naruco: {ratio:.2f} times bare decoding at 1920 x 1080, 60 Hz, four robots")
        assert ratio < 2.2


def test_watching_720p_takes_at_most_a_third_of_one_core(tmp_path, benchmark):
    camera = Camera(optics=overhead(width_px=1280, height_px=720), blur_px=0.5)
    write_video(film(camera, Scene(), four_robots(), np.random.default_rng(1)), tmp_path / "film.mp4")

    def watched():
        film = Film(following("aruco"))
        for frame in FilmSource(tmp_path / "film.mp4", "gray", patience_s=0.0).events():
            film.put(frame)
            film.following.latest()
        return film.seen(0.0, SECONDS).tracks

    tracks = benchmark.pedantic(watched, rounds=3)
    assert [track.valid.all() for track in tracks] == [True] * 4
    if benchmark.enabled:
        ratio = SECONDS / benchmark.stats.stats.min
        benchmark.extra_info["times_real_time"] = round(ratio, 1)
        print(f"\nwatching: {ratio:.1f} times real time at 1280 x 720, 30 Hz, four robots")
        assert ratio >= 3


def test_a_lost_colour_costs_at_most_three_times_a_seen_one(tmp_path, benchmark):
    record(tmp_path / "film.mp4", Scene(colours_bgr=COLOURS_BGR))
    pictures = list(read_frames(tmp_path / "film.mp4", "bgr"))
    gone = [Frame(one.time_s, np.full_like(one.image, 120)) for one in pictures]
    seen_s = min(seconds_of_processor(lambda: tracker("colour:cyan").track(pictures)) for _ in range(3))
    benchmark.pedantic(
        tracker("colour:cyan").track,
        args=(pictures[:1] + [Frame(one.time_s + 10.0, one.image) for one in gone],),
        rounds=3,
    )
    if benchmark.enabled:
        ratio = benchmark.stats.stats.min / seen_s
        benchmark.extra_info["times_a_seen_colour"] = round(ratio, 2)
        print(f"\na lost colour: {ratio:.2f} times a seen one")
        assert ratio < 3


def test_filming_takes_at_most_half_of_the_time_filmed(tmp_path, benchmark):
    benchmark.pedantic(record, args=(tmp_path / "film.mp4", Scene()), rounds=3)
    ratio = times_real_time(benchmark, "filming")
    assert ratio is None or ratio >= 2
