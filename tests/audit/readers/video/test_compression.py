import numpy as np
import pytest

from mtm_audit.readers.video.compression import read_compression
from tests.audit.readers.video.films import HEIGHT, WIDTH, Encoding, pictures, write_film


@pytest.mark.parametrize("quantiser", [14, 22, 34])
def test_the_quantiser_of_h264_is_that_of_the_encoder(tmp_path, quantiser):
    film = write_film(tmp_path / "film.mp4", pictures(40), Encoding(options={"qp": str(quantiser), "bf": "0"}))
    found = read_compression(film)
    assert found.codec == "h264"
    assert found.quantiser == pytest.approx(quantiser, abs=0.5)


def test_bits_are_those_of_the_packets(tmp_path):
    film = write_film(tmp_path / "film.mkv", pictures(40), Encoding(codec="mjpeg", pixel_format="yuvj420p"))
    found = read_compression(film)
    assert found.quantiser is None
    assert found.bits_per_pixel == pytest.approx(8 * film.stat().st_size / 40 / WIDTH / HEIGHT, rel=0.05)


def test_a_coarser_film_carries_less_motion(tmp_path):
    limits = []
    for quantiser in (13, 23, 33):
        film = write_film(tmp_path / f"film{quantiser}.mp4", pictures(20), Encoding(options={"qp": str(quantiser)}))
        limits.append(read_compression(film).smallest_motion_px)
    assert np.all(np.diff([low for low, _ in limits]) > 0.0)
    assert all(low < high for low, high in limits)
    # What was measured at 13, twice as much ten steps further, and so on.
    assert [low for low, _ in limits] == pytest.approx([0.03, 0.06, 0.12], rel=0.1)


def test_a_film_that_breaks_off_still_tells(tmp_path):
    film = write_film(tmp_path / "film.mkv", pictures(60))
    film.write_bytes(film.read_bytes()[: film.stat().st_size // 2])
    assert read_compression(film).bits_per_pixel > 0.0
