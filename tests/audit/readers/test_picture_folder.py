import zlib

import cv2
import numpy as np
import pytest

from mtm_audit.readers.picture_folder import pictures_in, read_pictures
from mtm_onboard.protocol import MtmError


def save(folder, *names):
    """Pictures whose gray is their place in the order given."""
    for place, name in enumerate(names):
        cv2.imwrite(str(folder / name), np.full((16, 24), 10 * place, np.uint8))
    return folder


def times_of(folder, **asked):
    return [frame.time_s for frame in read_pictures(pictures_in(folder), **asked)]


def test_numbers_in_names_give_the_order(tmp_path):
    save(tmp_path, "f8.jpg", "f9.jpg", "f10.jpg", "f11.jpg")
    frames = list(read_pictures(pictures_in(tmp_path), frame_rate_hz=10.0))
    assert [int(np.median(frame.image)) for frame in frames] == [0, 10, 20, 30]
    assert [frame.time_s for frame in frames] == pytest.approx([0.0, 0.1, 0.2, 0.3])
    assert frames[0].size == (24, 16)


def test_a_number_that_is_missing_leaves_its_time_empty(tmp_path):
    save(tmp_path, "f0.png", "f2.png", "f4.png", "f8.png", "f10.png")
    assert times_of(tmp_path, frame_rate_hz=10.0) == pytest.approx([0.0, 0.1, 0.2, 0.4, 0.5])


def test_names_that_do_not_count_steadily_give_the_order_alone(tmp_path):
    save(tmp_path, "f1.png", "f7.png", "f19.png", "f20.png")
    assert times_of(tmp_path, frame_rate_hz=10.0) == pytest.approx([0.0, 0.1, 0.2, 0.3])


@pytest.mark.parametrize(
    "names",
    [
        ("1403636579763555584.png", "1403636579813555456.png"),
        ("1403636579763555.png", "1403636579813555.png"),
        ("1403636579.763555.png", "1403636579.813555.png"),
    ],
)
def test_names_that_are_times_give_the_times(tmp_path, names):
    warnings = []
    times_s = times_of(save(tmp_path, *names), warn=warnings.append)
    assert times_s == pytest.approx([1403636579.763555, 1403636579.813555], abs=2e-6)
    assert len(warnings) == 1


def test_without_a_rate_other_names_are_refused(tmp_path):
    with pytest.raises(MtmError, match="--frame-rate"):
        times_of(save(tmp_path, "f1.png", "f2.png"))


# A PNG header that announces a picture of 2^31 x 2^31 pixels, its checksum right.
HUGE = b"\x89PNG\r\n\x1a\n\0\0\0\rIHDR\x7f\xff\xff\xff\x7f\xff\xff\xff\x08\x02\0\0\0"
HUGE += zlib.crc32(HUGE[12:]).to_bytes(4, "big")


@pytest.mark.parametrize("content", [b"", b"no picture", HUGE])
def test_a_picture_that_is_none_is_named(tmp_path, content):
    save(tmp_path, "f1.png", "f2.png")
    (tmp_path / "f2.png").write_bytes(content)
    with pytest.raises(MtmError, match=r"f2\.png is no picture"):
        times_of(tmp_path, frame_rate_hz=30.0)
