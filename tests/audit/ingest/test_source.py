import cv2
import numpy as np
import pytest

from hil.sensors.motion_capture import write_tum
from mtm_audit.ingest.recording import read_recording, recording_files
from mtm_audit.ingest.source import sources_of
from mtm_audit.model.track import Track
from mtm_onboard.protocol import MtmError
from tests.audit.readers.video.films import write_film


def touch(*paths):
    """Files of no content that matters, which are told apart by their names."""
    for path in paths:
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(b"\0 some film")


def files_of(*paths):
    return [source.files for source in sources_of(paths)]


def still_body(path):
    times_s = np.arange(10) / 10
    write_tum(Track(path.stem, times_s, np.zeros((10, 2)), np.ones(10, bool), headings_rad=np.zeros(10)), path)


def test_chapters_of_a_gopro_are_one_film_in_their_order(tmp_path):
    names = ["GX020123.MP4", "GX010124.MP4", "GX010123.MP4", "GX030123.MP4"]
    touch(*(tmp_path / name for name in names))
    first = tuple(tmp_path / f"GX0{chapter}0123.MP4" for chapter in (1, 2, 3))
    assert files_of(*(tmp_path / name for name in names)) == [first, (tmp_path / "GX010124.MP4",)]


def test_chapters_of_older_gopros_begin_with_another_name(tmp_path):
    names = ["GP010042.MP4", "GP020042.MP4", "GOPR0042.MP4"]
    touch(*(tmp_path / name for name in names))
    assert files_of(tmp_path) == [tuple(tmp_path / name for name in ("GOPR0042.MP4", "GP010042.MP4", "GP020042.MP4"))]


def test_a_missing_chapter_is_named(tmp_path):
    touch(tmp_path / "GH010123.MP4", tmp_path / "GH030123.MP4")
    with pytest.raises(MtmError, match=r"chapters 1 and 3 of one film.*missing"):
        sources_of([tmp_path])


def test_films_that_are_not_chapters_are_recordings_of_their_own(tmp_path):
    touch(tmp_path / "one.mp4", tmp_path / "two.mov")
    assert files_of(tmp_path / "one.mp4", tmp_path / "two.mov") == [(tmp_path / "one.mp4",), (tmp_path / "two.mov",)]
    with pytest.raises(MtmError, match="different films"):
        recording_files([tmp_path])


def test_a_folder_stands_for_its_film_whatever_lies_beside_it(tmp_path):
    touch(tmp_path / "video.mp4")
    (tmp_path / "robot.key").write_text("no key")
    (tmp_path / "truth.json").write_text("{}")
    (tmp_path / "mocap").mkdir()
    still_body(tmp_path / "mocap/robot0.tum")
    assert files_of(tmp_path) == [(tmp_path / "video.mp4",)]


def test_without_a_film_the_motion_capture_of_a_record_is_read(tmp_path):
    (tmp_path / "mocap").mkdir()
    (tmp_path / "truth.json").write_text("{}")
    still_body(tmp_path / "mocap/robot0.tum")
    (source,) = sources_of([tmp_path])
    assert source.kind == "motion capture"
    assert source.files == (tmp_path / "mocap/robot0.tum",)


def test_a_folder_of_pictures_is_one_film(tmp_path):
    for number in (9, 10, 11):
        cv2.imwrite(str(tmp_path / f"frame{number}.png"), np.zeros((16, 16), np.uint8))
    assert files_of(tmp_path) == [(tmp_path,)]


def test_a_single_picture_is_refused(tmp_path):
    cv2.imwrite(str(tmp_path / "photo.png"), np.zeros((16, 16), np.uint8))
    with pytest.raises(MtmError, match="single picture"):
        sources_of([tmp_path / "photo.png"])
    with pytest.raises(MtmError, match="holds no video, no pictures"):
        sources_of([tmp_path])


def test_chapters_are_joined_where_one_ends(tmp_path):
    marker = cv2.aruco.generateImageMarker(cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50), 3, 48)
    shown = np.full((96, 128, 3), 255, np.uint8)
    shown[24:72, 40:88] = marker[..., None]
    for chapter, count in ((1, 20), (2, 15)):
        write_film(tmp_path / f"GX0{chapter}0123.MP4", [shown] * count)
    files, kind = recording_files([tmp_path])
    (track,) = read_recording(files, kind).tracks
    assert track.times_s == pytest.approx(np.arange(35) / 30)
    (even,) = read_recording(files, kind, frame_rate_hz=60.0).tracks
    assert even.times_s == pytest.approx(np.arange(35) / 60)
