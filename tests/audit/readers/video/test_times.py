from fractions import Fraction

import numpy as np
import pytest

from mtm_audit.readers.video import read_frames
from mtm_onboard.protocol import MtmError
from tests.audit.readers.video.films import Encoding, pictures, remux, write_film


def read(path, **asked):
    """Times of the frames, the frames, and the warnings."""
    warnings = []
    frames = list(read_frames(path, warn=warnings.append, **asked))
    return np.array([frame.time_s for frame in frames]), frames, warnings


def test_what_an_edit_list_hides_is_no_damage(tmp_path):
    gops = Encoding(options={"g": "60", "bf": "0", "sc_threshold": "0"})
    whole = write_film(tmp_path / "whole.mp4", pictures(240), gops)
    times_s, frames, warnings = read(remux(whole, tmp_path / "cut.mp4", from_s=2.5))
    assert len(frames) == 165
    assert times_s == pytest.approx(np.arange(165) / 30)
    assert not warnings


def test_what_is_cut_off_at_the_end_is_no_damage(tmp_path):
    whole = write_film(tmp_path / "whole.mp4", pictures(90))
    times_s, _, warnings = read(remux(whole, tmp_path / "cut.mp4", until_s=2.0))
    assert len(times_s) == 60
    assert not warnings


@pytest.mark.parametrize(
    "encoding",
    [Encoding(codec="mjpeg", pixel_format="yuvj420p"), Encoding(), Encoding(options={"bf": "0"})],
    ids=["mjpeg", "h264 with b-frames", "h264"],
)
def test_skipped_frames_of_an_avi_are_no_damage(tmp_path, encoding):
    film = write_film(tmp_path / "film.avi", pictures(90), encoding, skipped=(5, 6, 7, 30))
    times_s, _, warnings = read(film)
    assert times_s == pytest.approx(np.delete(np.arange(90), [5, 6, 7, 30]) / 30)
    assert not warnings


def test_b_frames_in_avi_are_all_read_at_even_times(tmp_path):
    film = write_film(tmp_path / "film.avi", pictures(60), Encoding(options={"bf": "3", "crf": "5"}))
    times_s, frames, warnings = read(film, pixels="bgr")
    assert times_s == pytest.approx(np.arange(60) / 30)
    assert not warnings
    for frame, shown in zip(frames, pictures(60), strict=True):
        assert np.abs(frame.image.astype(int) - shown).mean() < 12


def test_an_avi_with_uneven_times_is_whole(tmp_path):
    stamps = [20 * number + 7 * number % 5 for number in range(60)]
    film = write_film(tmp_path / "film.avi", pictures(60), Encoding(rate_hz=1000, options={"bf": "0"}), stamps=stamps)
    times_s, _, warnings = read(film)
    assert times_s == pytest.approx(np.array(stamps) / 1000)
    assert not warnings


@pytest.mark.parametrize("suffix", ["mkv", "avi", "mp4"])
def test_a_copy_that_broke_off_says_how_much_is_missing(tmp_path, suffix):
    film = tmp_path / f"film.{suffix}"

    def index_first(container, stream):
        if suffix == "mp4":
            container.options["movflags"] = "frag_keyframe"

    write_film(film, pictures(150), Encoding(options={"g": "30", "bf": "0"}), prepare=index_first)
    film.write_bytes(film.read_bytes()[: film.stat().st_size // 2])
    times_s, _, warnings = read(film)
    assert 20 < len(times_s) < 130
    if suffix != "mp4":  # a film in fragments does not say how long it is
        assert "are missing" in warnings[0]


@pytest.mark.parametrize(("codec", "bare"), [("libx264", "h264"), ("libx265", "hevc")])
def test_a_bare_stream_is_read_at_the_rate_it_states(tmp_path, codec, bare):
    quiet = {"x265-params": "log-level=none"} if codec == "libx265" else {}
    film = write_film(
        tmp_path / f"camera.{bare}", pictures(60), Encoding(codec=codec, format=bare, rate_hz=60, options=quiet)
    )
    times_s, _, warnings = read(film)
    assert times_s == pytest.approx(np.arange(60) / 60)
    assert len(warnings) == 1
    assert "without times" in warnings[0]
    assert "60 a second" in warnings[0]


def test_a_bare_stream_without_a_rate_needs_one(tmp_path):
    film = write_film(
        tmp_path / "camera.mjpeg", pictures(30), Encoding(codec="mjpeg", format="mjpeg", pixel_format="yuvj420p")
    )
    with pytest.raises(MtmError, match="--frame-rate"):
        read(film)
    times_s, _, warnings = read(film, frame_rate_hz=15.0)
    assert times_s == pytest.approx(np.arange(30) / 15)
    assert not warnings


def test_a_given_rate_replaces_the_times_of_the_file(tmp_path):
    film = write_film(tmp_path / "film.mp4", pictures(30))
    assert read(film, frame_rate_hz=120.0)[0] == pytest.approx(np.arange(30) / 120)


@pytest.mark.parametrize("rate_hz", [0.0, -1.0, np.inf, np.nan])
def test_no_film_has_such_a_rate(tmp_path, rate_hz):
    with pytest.raises(MtmError, match="above zero"):
        read(write_film(tmp_path / "film.mp4", pictures(3)), frame_rate_hz=rate_hz)


def test_a_transport_stream_keeps_the_clock_of_its_sender(tmp_path):
    whole = write_film(tmp_path / "whole.ts", pictures(60), Encoding(options={"bf": "0"}))
    times_s, _, warnings = read(remux(whole, tmp_path / "later.ts", shift_s=50_000.0))
    assert times_s - times_s[0] == pytest.approx(np.arange(60) / 30, abs=1e-4)
    assert times_s[0] == pytest.approx(50_000.0, abs=2.0)
    assert not warnings


def test_a_capture_that_begins_between_key_frames_is_read(tmp_path):
    gops = Encoding(options={"g": "30", "bf": "0", "sc_threshold": "0"})
    content = write_film(tmp_path / "whole.ts", pictures(90), gops).read_bytes()
    late = tmp_path / "late.ts"
    late.write_bytes(content[len(content) // 5 // 188 * 188 :])
    times_s, _, _ = read(late)
    assert len(times_s) == 60
    assert np.diff(times_s) == pytest.approx(1 / 30, abs=1e-4)


def test_an_mp4_whose_first_time_was_cut_keeps_its_steps(tmp_path):
    # Muxers write the start in whole milliseconds unless they are told otherwise.
    stamps = [33.9, *(33.9 + 1000 / 30 * number for number in range(1, 60))]
    encoding = Encoding(rate_hz=90_000)
    ticks = [round(90 * stamp) for stamp in stamps]

    def finely(_, stream):
        stream.codec_context.time_base = stream.time_base = Fraction(1, 90_000)

    film = write_film(tmp_path / "film.mp4", pictures(60), encoding, stamps=ticks, prepare=finely)
    times_s, _, warnings = read(film)
    assert 0.033 - 1e-6 <= times_s[0] <= 0.034
    assert times_s - times_s[0] == pytest.approx((np.array(ticks) - ticks[0]) / 90_000, abs=2e-5)
    assert not warnings
