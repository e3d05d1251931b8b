import numpy as np
import pytest

from mtm_audit.drawing.grid import draw_grid, grid_step_px


@pytest.mark.parametrize(
    ("size", "step"), [((1920, 1080), 100), ((704, 704), 50), ((320, 240), 20), ((40, 30), 10), ((4000, 10), 200)]
)
def test_lines_are_round_numbers_of_pixels_apart(size, step):
    assert grid_step_px(size) == step


@pytest.mark.parametrize("gray", [0, 100, 200, 255])
def test_lines_show_on_bright_and_on_dark(gray):
    picture = draw_grid(np.full((240, 320, 3), gray, np.uint8))
    middle = picture[110, 100:140, 0].astype(int)
    assert np.flatnonzero(np.abs(middle - gray) > 40).tolist() == [0, 20]


def test_the_picture_given_stays_as_it_is():
    image = np.full((100, 100, 3), 200, np.uint8)
    assert draw_grid(image).shape == image.shape
    assert np.all(image == 200)


def test_a_tiny_picture_has_room_for_no_line():
    assert np.all(draw_grid(np.full((8, 8, 3), 9, np.uint8)) == 9)
