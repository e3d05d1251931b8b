"""Calibrations of lenses: every kind of file gives the same lens, and what is no calibration is refused."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_audit.model.lens import Lens
from mtm_audit.readers.lens_file import read_lens
from mtm_onboard.protocol import MtmError
from tests.audit.readers.calibrations import (
    CENTRE_PX,
    FISHEYE,
    FOCAL_PX,
    MATRIX,
    RADIAL,
    SIZE_PX,
    camera_info,
    camera_info_message,
    opencv_file,
)

LENS = Lens(name="", size_px=SIZE_PX, focal_px=FOCAL_PX, centre_px=CENTRE_PX, distortion=RADIAL)
RATIONAL = (-0.3, 0.1, 1e-05, 2e-05, 0.01, 0.02, 0.03, 0.004)


@pytest.fixture
def read(tmp_path):
    def _read(text, name="camera.yaml"):
        path = tmp_path / name
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return replace(read_lens(path), name="")

    return _read


def test_camera_info_of_ros_is_read(read):
    assert read(camera_info()) == replace(LENS, distortion=(*RADIAL, 0.0))
    assert read(camera_info("rational_polynomial", RATIONAL)) == replace(LENS, distortion=RATIONAL)
    fisheye = read(camera_info("equidistant", FISHEYE))
    assert fisheye == replace(LENS, distortion=FISHEYE, model="fisheye")


def test_the_first_message_of_a_topic_is_read(read):
    assert read(camera_info_message()) == replace(LENS, distortion=(*RADIAL, 0.0))


def test_what_opencv_writes_is_read(read, tmp_path):
    path = opencv_file(tmp_path / "camera.yml")
    assert replace(read_lens(path), name="") == LENS
    assert read_lens(path).name == str(path)
    wide = opencv_file(tmp_path / "wide.yml", FISHEYE, fisheye=True)
    assert replace(read_lens(wide), name="") == replace(LENS, distortion=FISHEYE, model="fisheye")
    plain = opencv_file(tmp_path / "plain.yml", RADIAL, fisheye=False)
    assert read_lens(plain).model == "radial"


def test_the_first_line_of_opencv_4_is_no_obstacle(read):
    head = '%YAML:1.0\n---\ncalibration_time: "Sat 28 Nov 2026"\nimage_width: 752\nimage_height: 480\n'
    matrix = f"camera_matrix: !!opencv-matrix\n   rows: 3\n   cols: 3\n   dt: d\n   data: {np.ravel(MATRIX).tolist()}\n"
    bent = (
        "distortion_coefficients: !!opencv-matrix\n   rows: 4\n   cols: 1\n   dt: d\n   data: [ 1e-1, 0., -.5, 3e-05 ]"
    )
    assert read(head + matrix + bent) == replace(LENS, distortion=(0.1, 0.0, -0.5, 3e-05))


def test_a_lens_that_does_not_distort_is_one(read):
    assert read(camera_info(distortion=(0.0,) * 5)).distortion == (0.0,) * 5


SKEWED = np.array([[458.0, 2.0, 367.0], [0.0, 457.0, 248.0], [0.0, 0.0, 1.0]])


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "without names and values"),
        ("image_width: [", "is no YAML that can be read"),
        ("[" * 5000, "is no YAML that can be read"),
        ("- 1\n- 2\n", "without names and values"),
        ("image_width: 752\n", "without image_height"),
        (camera_info().replace("752", "0"), "image_width is no number of pixels"),
        (camera_info().replace("752", "7.5"), "image_width is no number of pixels"),
        (camera_info().replace("camera_matrix", "matrix"), "without camera_matrix"),
        (camera_info(matrix=SKEWED), "is not that of a camera"),
        (camera_info(matrix=-MATRIX), "is not that of a camera"),
        (camera_info(matrix=MATRIX[:2]), "camera_matrix is not 9 numbers"),
        (camera_info(distortion=RADIAL[:3]), "with 3 coefficients of distortion, where its model has 4 or 5 or 8"),
        (camera_info("equidistant"), "with 5 coefficients of distortion, where its model has 4"),
        (camera_info(distortion=(np.nan,) * 4), "distortion_coefficients is not all numbers"),
        (camera_info(distortion=(0.0,) * 20), "distortion_coefficients is no list of numbers"),
        (camera_info("omni"), "of the distortion model 'omni'"),
        (camera_info("[1]"), "of the distortion model"),
        ("a: &a [b, b]\nc: &c [*a, *a]\nimage_width: *c\nimage_height: 2\n", "image_width is no number of pixels"),
        ("x" * (1 << 20) + "y", "of more than 1048576 bytes"),
    ],
)
def test_what_is_no_calibration_is_refused_with_a_word(read, text, words):
    with pytest.raises(MtmError, match=words):
        read(text)


def test_a_missing_calibration_is_told(tmp_path):
    with pytest.raises(MtmError, match="cannot read the calibration"):
        read_lens(tmp_path / "none.yaml")


@given(st.text() | st.text(alphabet="imageidth_cr: []{}&*!%-\n0.5e") | st.binary())
def test_nothing_in_a_file_ends_but_in_a_sentence(tmp_path_factory, text):
    path = tmp_path_factory.getbasetemp() / "any.yaml"
    path.write_bytes(text if isinstance(text, bytes) else text.encode("utf-8", "surrogatepass"))
    with pytest.raises(MtmError):
        read_lens(path)


@given(
    st.tuples(st.integers(2, 9000), st.integers(2, 9000)),
    st.tuples(*[st.floats(1.0, 1e5)] * 2),
    st.tuples(*[st.floats(-1e4, 1e4)] * 2),
    st.tuples(*[st.floats(-10.0, 10.0)] * 5),
)
def test_numbers_come_back_as_they_were_written(tmp_path_factory, size_px, focal_px, centre_px, distortion):
    matrix = np.array([[focal_px[0], 0.0, centre_px[0]], [0.0, focal_px[1], centre_px[1]], [0.0, 0.0, 1.0]])
    path = tmp_path_factory.getbasetemp() / "numbers.yaml"
    path.write_text(camera_info("plumb_bob", distortion, size_px, matrix))
    lens = read_lens(path)
    assert lens == Lens(name=str(path), size_px=size_px, focal_px=focal_px, centre_px=centre_px, distortion=distortion)
