"""Damaged films end in a sentence or in the pictures before the damage, and in nothing else."""

from contextlib import suppress

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from mtm_audit.readers.video import inspect_video, read_frames
from mtm_audit.readers.video.compression import read_compression
from mtm_onboard.protocol import MtmError
from tests.audit.readers.video.films import Encoding, pictures, turn, write_film

KINDS = {
    "film.mp4": Encoding(),
    "film.mkv": Encoding(),
    "film.ts": Encoding(),
    "film.avi": Encoding(),
    "film.h264": Encoding(format="h264"),
    "hevc.mp4": Encoding(codec="libx265", options={"x265-params": "log-level=none"}),
    "mjpeg.avi": Encoding(codec="mjpeg", pixel_format="yuvj420p"),
}
DAMAGE = st.tuples(st.floats(0.0, 1.0, exclude_max=True), st.binary(min_size=0, max_size=6), st.integers(0, 40))


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """The content of a whole film of each kind."""
    folder = tmp_path_factory.mktemp("whole")
    films = {name: write_film(folder / name, pictures(12), encoding) for name, encoding in KINDS.items()}
    turn(films["film.mp4"], 90)
    return {name: film.read_bytes() for name, film in films.items()}


@pytest.mark.parametrize("name", KINDS)
@settings(max_examples=30, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(damage=st.lists(DAMAGE, min_size=1, max_size=8))
def test_a_damaged_film_is_read_or_refused(whole, tmp_path, name, damage):
    content = bytearray(whole[name])
    for place, written, lost in damage:
        start = int(place * len(content))
        content[start : start + len(written) + lost] = written
    film = tmp_path / name
    film.write_bytes(content)
    for read in (inspect_video, lambda film: list(read_frames(film, "bgr")), read_compression):
        with suppress(MtmError):
            read(film)


def test_a_codec_without_a_decoder_is_refused(whole, tmp_path):
    film = tmp_path / "film.mp4"
    film.write_bytes(whole["film.mp4"].replace(b"avc1", b"zzz1"))
    with pytest.raises(MtmError, match=r"cannot be read here|no picture|not a video"):
        list(read_frames(film))
