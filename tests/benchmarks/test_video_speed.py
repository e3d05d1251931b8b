"""What reading a film costs beside decoding it and doing nothing with it, with the same threads.

The whole time of the wall is compared, since both sides decode in the library's threads; each is the best of some runs.
"""

import time

import av
import cv2
import numpy as np
import pytest

from mtm_audit.readers.video import read_frames

pytestmark = pytest.mark.skipif("not config.getoption('benchmark_enable')", reason="measures; see the docstring")

ROUNDS = 7
FRAMES = 180


@pytest.fixture(scope="module")
def film(tmp_path_factory):
    """Three seconds of 1080p60 as an action camera writes it: noise all over, and a camera that moves."""
    path = tmp_path_factory.mktemp("speed") / "film.mp4"
    draw = np.random.default_rng(1)
    scene = cv2.resize(draw.integers(0, 255, (60, 100, 3), dtype=np.uint8), (2000, 1160), interpolation=cv2.INTER_CUBIC)
    noise = draw.normal(0.0, 2.0, (1160, 2000, 3))
    scene = np.clip(scene + noise, 0, 255).astype(np.uint8)
    with av.open(str(path), "w") as container:
        stream = container.add_stream("libx264", rate=60, options={"preset": "superfast", "crf": "20"})
        stream.width, stream.height, stream.pix_fmt = 1920, 1080, "yuv420p"
        for number in range(FRAMES):
            seen = np.ascontiguousarray(scene[number % 40 : number % 40 + 1080, number % 60 : number % 60 + 1920])
            container.mux(stream.encode(av.VideoFrame.from_ndarray(seen, format="bgr24")))
        container.mux(stream.encode(None))
    return path


def decode_alone(path):
    with av.open(str(path)) as container:
        stream = container.streams.video[0]
        stream.thread_type = "AUTO"
        return sum(1 for _ in container.decode(stream))


def read(path, pixels):
    return sum(1 for _ in read_frames(path, pixels))


def best_s(function, *arguments):
    times_s = []
    for _ in range(ROUNDS):
        start_s = time.perf_counter()
        assert function(*arguments) == FRAMES
        times_s.append(time.perf_counter() - start_s)
    return min(times_s)


@pytest.mark.parametrize(("pixels", "most"), [("gray", 1.15), ("bgr", 2.5)])
def test_reading_costs_little_more_than_decoding(benchmark, film, pixels, most):
    alone_s = best_s(decode_alone, film)
    benchmark.pedantic(read, args=(film, pixels), rounds=ROUNDS)
    ratio = benchmark.stats.stats.min / alone_s
    benchmark.extra_info["times_decoding"] = round(ratio, 2)
    print(f"\nreading {pixels} at 1080p60: {ratio:.2f} times decoding alone")
    assert ratio <= most
