import pytest

from mtm_audit.live.films import Address
from mtm_audit.live.sources import source_of
from mtm_onboard.protocol import MtmError


def test_poses_are_received_at_an_address():
    source = source_of("udp://127.0.0.1:5005")
    assert (source.is_film, source.is_live, source.target) == (False, True, ("127.0.0.1", 5005))


def test_a_password_is_shown_to_nobody():
    source = source_of("rtsp://admin:not-a-real-password@camera.local:554/stream?token=fake")
    assert source.shown == "rtsp://camera.local:554/stream"
    assert isinstance(source.target, Address)
    assert "not-a-real-password" in source.target.url


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("udp://127.0.0.1", "no address and port"),
        ("udp://:5005", "no address and port"),
        ("ftp://camera/film", "cannot be watched"),
        ("concat://a", "cannot be watched"),
        ("http://camera:notaport/", "cannot be read"),
        ("no such file", "cannot read"),
    ],
)
def test_what_cannot_be_watched_is_one_sentence(name, words):
    with pytest.raises(MtmError, match=words):
        source_of(name)


def test_a_text_file_holds_poses_and_any_other_a_film(tmp_path):
    (tmp_path / "poses.csv").write_text("r,1,2,3\n")
    (tmp_path / "film.mkv").write_bytes(b"\x1aE\xdf\xa3")
    assert not source_of(str(tmp_path / "poses.csv")).is_film
    assert source_of(str(tmp_path / "film.mkv")).is_film
