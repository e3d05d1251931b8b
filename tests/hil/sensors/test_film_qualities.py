import av
import numpy as np
import pytest

from hil.cli import QualityName
from hil.sensors.encoding import constant_quality
from hil.sensors.film_qualities import FILM_QUALITIES, write_quality
from hil.sensors.video import encode_video
from mtm_audit.model.picture import Frame
from mtm_audit.readers.video import read_frames

RATE_HZ = 30.0
SIDE_PX = 240


def frames(count):
    """A noisy picture that moves, so that no encoder gets it for nothing."""
    draw = np.random.default_rng(3)
    still = draw.integers(60, 200, (SIDE_PX, SIDE_PX, 3))
    for number in range(count):
        noise = draw.normal(0.0, 3.0, still.shape)
        yield Frame(number / RATE_HZ, np.clip(np.roll(still, number, axis=1) + noise, 0, 255).astype(np.uint8))


def test_the_command_line_names_every_quality():
    assert [name.value for name in QualityName] == list(FILM_QUALITIES)


@pytest.mark.parametrize("name", FILM_QUALITIES)
def test_a_film_is_as_its_makers_write_it(tmp_path, name):
    quality, path = FILM_QUALITIES[name], tmp_path / "film.mp4"
    count = write_quality(frames(90), path, RATE_HZ, quality)
    assert count == 90 / quality.every
    seen = list(read_frames(path))
    assert [frame.time_s for frame in seen] == pytest.approx(np.arange(0, 90, quality.every) / RATE_HZ, abs=1e-4)
    assert seen[0].size[0] == pytest.approx(quality.scale * SIDE_PX, abs=2)
    wanted = quality.encoding.bits_per_pixel * count * seen[0].size[0] * seen[0].size[1] / 8.0
    assert 0.4 * wanted < path.stat().st_size < 2.5 * wanted
    with av.open(str(path)) as film:
        stream = film.streams.video[0]
        assert stream.codec_context.name == {"libx265": "hevc", "libx264": "h264"}[quality.encoding.codec]
        keys = [float(packet.pts * packet.time_base) for packet in film.demux(stream) if packet.is_keyframe]
    assert np.diff(keys) == pytest.approx(quality.encoding.key_every_s, abs=0.1)


def test_a_messenger_leaves_less_than_the_phone_wrote(tmp_path):
    sizes = {}
    for name in ("phone", "messenger"):
        write_quality(frames(60), tmp_path / f"{name}.mp4", RATE_HZ, FILM_QUALITIES[name])
        sizes[name] = (tmp_path / f"{name}.mp4").stat().st_size
    assert sizes["messenger"] < 0.4 * sizes["phone"]


@pytest.mark.parametrize("encoding", [constant_quality(23), FILM_QUALITIES["phone"].encoding], ids=["archive", "phone"])
def test_a_film_is_the_same_on_machines_of_any_size(tmp_path, encoding):
    path = tmp_path / "film.mp4"
    encode_video(frames(8), path, RATE_HZ, encoding)
    content = path.read_bytes()
    # The encoder writes into the film how it was set up.
    assert b"threads=1 " in content or b"frame-threads=1 " in content
