"""Whole decodes of one film in every codec, container and speed."""

import json
import shutil
from datetime import UTC, datetime

import cv2
import pytest

from mtm_audit import DecodeSettings, decode
from mtm_audit.cli import main
from mtm_audit.decoding.speeds import SPEEDS
from mtm_audit.readers.video import read_frames
from mtm_onboard.protocol import save_key
from mtm_onboard.protocol.slots import slot_start_unix_s
from tests.audit.filmed_robots import KEY, MESSAGE, ONSET_S, Copy, film_robots, transcode
from tests.audit.moving_robot import key_of, scheme_of

X264 = {"preset": "veryfast", "crf": "10"}
X265 = {"preset": "ultrafast", "x265-params": "log-level=none:crf=8"}
VP9 = {"crf": "10", "b": "0", "deadline": "realtime", "cpu-used": "7"}
AV1 = {"crf": "8", "preset": "10", "svtav1-params": "lp=1"}
MJPEG = {"qmin": "2", "qmax": "2"}
COPIES = (
    Copy(suffix="mov", codec="libx264", options=X264),
    Copy(suffix="mkv", codec="libx264", options=X264),
    Copy(suffix="ts", codec="libx264", options=X264),
    Copy(suffix="avi", codec="libx264", options=X264),
    Copy(suffix="h264", codec="libx264", options=X264, format="h264"),
    Copy(suffix="mp4", codec="libx265", options=X265, pixel_format="yuv420p10le"),
    Copy(suffix="webm", codec="libvpx-vp9", options=VP9),
    Copy(suffix="mkv", codec="libsvtav1", options=AV1),
    Copy(suffix="mp4", codec="libsvtav1", options=AV1),
    Copy(suffix="avi", codec="mjpeg", options=MJPEG, pixel_format="yuvj420p"),
)
H264 = COPIES[1]
# One with motion between pictures and one of pictures alone stand for the others where time is short.
QUICK = COPIES[0], COPIES[-1]


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """The key, and a film of its message."""
    path = tmp_path_factory.mktemp("films")
    save_key(KEY, path / "robot.key")
    film_robots(path / "film.mp4")
    return path


@pytest.fixture(scope="module")
def whole(folder):
    return decode(folder / "film.mp4", KEY)


@pytest.fixture
def audit(folder, capsys):
    """Run `mtm-audit decode`; gives exit code, standard output and standard error."""

    def run(*arguments):
        with pytest.raises(SystemExit) as left:
            main(["decode", *map(str, arguments), "--key", str(folder / "robot.key")])
        out, err = capsys.readouterr()
        assert "Traceback" not in out + err
        return left.value.code or 0, out, err

    return run


@pytest.mark.parametrize(
    "copy",
    [
        pytest.param(copy, id=f"{copy.codec} in {copy.suffix}", marks=() if copy in QUICK else pytest.mark.slow)
        for copy in COPIES
    ],
)
def test_a_copy_in_another_codec_says_the_same(folder, tmp_path, whole, copy):
    copied = decode(transcode(folder / "film.mp4", tmp_path / f"copy.{copy.suffix}", copy), KEY)
    assert (copied.verdict, copied.message) == (whole.verdict, whole.message) == ("decoded", MESSAGE)
    assert copied.evidence.bits == pytest.approx(whole.evidence.bits, rel=0.1)


@pytest.fixture(scope="module")
def slow(folder):
    """The film as slow motion, four times as long."""
    return transcode(folder / "film.mp4", folder / "slow.mkv", H264, speed=0.25)


def test_slow_motion_is_absent_with_the_possibility_named(audit, slow):
    code, out, _ = audit(slow)
    assert code == 3
    assert "--search-speed" in out
    assert "slow motion" in out
    assert "the film is H.264 at" in " ".join(out.split())
    assert "quantiser" in out


def test_slow_motion_of_a_known_speed_is_decoded(audit, slow, whole):
    code, out, _ = audit(slow, "--speed", "4", "--json")
    report = json.loads(out)
    assert (code, report["message"], report["recording"]["speed"]) == (0, MESSAGE, 4.0)
    assert report["evidence_bits"] == pytest.approx(whole.evidence.bits, rel=0.1)
    assert report["channels"][0]["rate_hz"] == pytest.approx(50.0, rel=0.01)


def test_an_onset_is_meant_in_the_time_of_the_file(audit, slow):
    code, out, _ = audit(slow, "--speed", "4", "--onset", 4 * ONSET_S, "--json")
    assert code == 0
    assert json.loads(out)["channels"][0]["onset_s"] == pytest.approx(ONSET_S, abs=0.3)


def test_a_known_frame_rate_is_decoded(audit, slow):
    code, out, _ = audit(slow, "--frame-rate", "30")
    assert (code, out.splitlines()[0].split(" (")[0]) == (0, f"decoded: message {MESSAGE}")


@pytest.mark.slow
@pytest.mark.parametrize(("speed", "every"), [(4.0, 4), (2 / 3, 1)])
def test_a_searched_speed_is_found_and_paid_for(audit, folder, tmp_path, speed, every):
    film = transcode(folder / "film.mp4", tmp_path / "film.mkv", H264, speed=speed, every=every)
    known = json.loads(audit(film, "--speed", 1 / speed, "--json")[1])
    code, out, _ = audit(film, "--search-speed", "--json")
    found = json.loads(out)
    assert found["recording"]["speed"] == pytest.approx(1 / speed)
    assert code == {"decoded": 0, "inconclusive": 4}[found["verdict"]]
    assert known["evidence_bits"] - found["evidence_bits"] == pytest.approx(3.907, abs=0.01)
    assert len(SPEEDS) == 15


@pytest.mark.slow
def test_a_coarse_film_without_a_message_stays_absent(audit, tmp_path):
    # What an encoder leaves of noise is red: most of it lies below 1 Hz, and some of it repeats.
    film = film_robots(tmp_path / "film.mp4", crf=30, symbols=None)
    assert audit(film)[0] == 3
    assert audit(film, "--search-speed")[0] == 3


def test_speed_and_search_exclude_each_other(audit, slow):
    assert audit(slow, "--speed", "4", "--search-speed")[0] == 2
    assert audit(slow, "--speed", "-1")[0] == 2


def test_two_frames_a_second_are_too_few_in_one_sentence(audit, folder, tmp_path):
    for every in (15, 30, 60):
        film = transcode(folder / "film.mp4", tmp_path / f"film{every}.mkv", H264, every=every)
        code, out, err = audit(film)
        assert (code, out) == (1, "")
        assert f"{30 / every:.2g} times a second, which is too seldom for a band up to 5 Hz" in err
        assert err.count("\n") == 1


@pytest.mark.slow
def test_a_date_means_the_first_frame_whatever_its_stamp(tmp_path, capsys):
    key = key_of(scheme_of(symbols=(1, 1), ticks=200, schedule="rolling"))
    save_key(key, tmp_path / "rolling.key")
    film_robots(tmp_path / "film.mp4", key=key)
    late = transcode(tmp_path / "film.mp4", tmp_path / "late.ts", COPIES[2], offset_s=50_000.0)
    begun = slot_start_unix_s(0, key.scheme) - ONSET_S
    at = datetime.fromtimestamp(begun, UTC).isoformat()
    with pytest.raises(SystemExit) as left:
        main(["decode", str(late), "--key", str(tmp_path / "rolling.key"), "--at", at, "--at-error", "1", "--json"])
    report = json.loads(capsys.readouterr().out)
    assert (left.value.code or 0, report["message"]) == (0, MESSAGE)
    assert report["channels"][0]["onset_s"] > 50_000.0


def test_a_folder_of_pictures_with_a_rate_is_decoded(audit, folder, tmp_path):
    for number, frame in enumerate(read_frames(folder / "film.mp4")):
        cv2.imwrite(str(tmp_path / f"frame{number:05}.png"), frame.image)
    assert "--frame-rate" in audit(tmp_path)[2]
    code, out, _ = audit(tmp_path, "--frame-rate", "30")
    assert (code, out.splitlines()[0].split(" (")[0]) == (0, f"decoded: message {MESSAGE}")


@pytest.mark.slow
def test_several_films_are_decoded_one_after_the_other(audit, folder, tmp_path):
    shutil.copy(folder / "film.mp4", tmp_path / "one.mp4")
    shutil.copy(folder / "film.mp4", tmp_path / "two.mp4")
    code, out, _ = audit(tmp_path / "one.mp4", tmp_path / "two.mp4", "--json")
    assert code == 0
    assert [report["message"] for report in json.loads(out)] == [MESSAGE, MESSAGE]
    (tmp_path / "three.mp4").write_bytes(b"\0 no film")
    code, out, err = audit(tmp_path)
    assert code == 1
    assert out.count("decoded: message") == 2
    assert err.count("three.mp4 is not a video") == 1
    assert audit(tmp_path, "--plot", tmp_path / "plot.png")[0] == 1
    assert audit(tmp_path, "--report", tmp_path / "report.html")[0] == 1


def test_an_api_decode_takes_the_same_options(folder, slow):
    settings = DecodeSettings(onset_s=4 * ONSET_S)
    assert decode(slow, KEY, speed=4.0, settings=settings).message == MESSAGE
    assert decode(slow, KEY, frame_rate_hz=30.0).message == MESSAGE
