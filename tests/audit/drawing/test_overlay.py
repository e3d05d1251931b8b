import numpy as np
import pytest

from mtm_audit.drawing.lettering import line_px, put_text, text_px
from mtm_audit.drawing.mark import Mark
from mtm_audit.drawing.overlay import draw
from mtm_audit.drawing.palette import colour_of

GRAY = np.full((360, 480), 128, np.uint8)
ORANGE = colour_of(0)


def square(column, row, half=20.0):
    return np.array([column, row]) + half * np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]])


def has_colour(picture, colour):
    """Where a picture has a colour, give or take what smooth edges mix."""
    return np.all(np.abs(picture.astype(int) - colour) < 30, axis=2)


def test_an_outline_is_drawn_where_it_is():
    picture = draw(GRAY, [Mark(name="a", place=(240, 200), outline=square(240, 200), colour=ORANGE)])
    shown = has_colour(picture, ORANGE)
    assert shown[200, 218:223].any()
    assert shown[180, 200:280].mean() > 0.4
    assert not shown[205:215, 230:250].any()


def test_the_picture_itself_stays_as_it_is():
    coloured = np.full((360, 480, 3), 128, np.uint8)
    picture = draw(coloured, [Mark(name="a", place=(240, 200))])
    assert np.all(coloured == 128)
    assert picture.shape == coloured.shape


def test_the_caption_hides_nothing_of_the_picture():
    picture = draw(GRAY, [], ("12.3 s", "decoded"))
    assert picture.shape[1:] == (480, 3)
    assert picture.shape[0] > 360
    assert np.all(picture[:360] == 128)
    assert picture[360:].max() == 255


def test_a_caption_too_long_for_the_picture_goes_on_below():
    short, long = draw(GRAY, [], ("one line",)), draw(GRAY, [], ("many words " * 12,))
    assert long.shape[1] == short.shape[1]
    assert long.shape[0] >= short.shape[0] + text_px(360)
    assert draw(GRAY, [], ("W" * 200,)).shape == short.shape


def test_a_thing_out_of_sight_is_drawn_at_its_last_place():
    trail = np.array([[100.0, 100.0], [120.0, 100.0], [np.nan, np.nan]])
    lost = Mark(name="a", place=None, trail=trail, colour=ORANGE)
    assert lost.last_place == (120.0, 100.0)
    shown = has_colour(draw(GRAY, [lost]), ORANGE)
    ring = shown[80:121, 100:141]
    assert 0 < ring.sum() < shown.sum()


def test_a_thing_that_was_never_seen_is_still_named():
    never = Mark(name="a", place=None, notes=("not seen",), colour=ORANGE)
    assert never.last_place is None
    assert has_colour(draw(GRAY, [never]), ORANGE)[:40, :60].any()


def test_a_trail_is_broken_where_nothing_was_seen():
    trail = np.array([[50.0, 300.0], [100.0, 300.0], [np.nan, np.nan], [200.0, 300.0], [250.0, 300.0]])
    shown = has_colour(draw(GRAY, [Mark(name="a", place=(250, 300), trail=trail, colour=ORANGE)]), ORANGE)
    assert shown[298:303, 60:90].any()
    assert not shown[298:303, 110:190].any()


def test_labels_do_not_lie_on_each_other():
    marks = [Mark(name="WWWW", place=(240 + 5 * n, 200), colour=colour_of(n)) for n in range(4)]
    picture = draw(GRAY, marks)
    alone = [has_colour(draw(GRAY, [mark]), mark.colour).sum() for mark in marks]
    for mark, count in zip(marks, alone, strict=True):
        assert has_colour(picture, mark.colour).sum() > 0.5 * count


def test_a_label_that_found_no_room_is_led_to_its_mark():
    crowd = [Mark(name="WWWWWWWW", place=(240 + 3 * n, 200 + 2 * n), colour=colour_of(n)) for n in range(8)]
    last = crowd[-1]
    led = has_colour(draw(GRAY, crowd), last.colour).sum()
    alone = has_colour(draw(GRAY, [last]), last.colour).sum()
    assert led > alone


@pytest.mark.parametrize("place", [(-500.0, 20.0), (479.0, 359.0), (0.0, 0.0), (1e6, -1e6)])
def test_places_at_and_beyond_the_edge_are_drawn(place):
    mark = Mark(name="a long name", place=place, outline=square(*place), heading_rad=1.0, passed=1.5, notes=("x",))
    assert draw(GRAY, [mark]).shape == (360, 480, 3)


def test_the_bar_shows_how_much_has_passed():
    full, empty = (
        has_colour(draw(GRAY, [Mark(name="a", place=(240, 200), passed=part, colour=ORANGE)]), ORANGE).sum()
        for part in (1.0, 0.0)
    )
    assert full > empty + 20


def test_letters_and_lines_grow_with_the_picture():
    assert text_px(1080) == 2 * text_px(540)
    assert line_px(1080) > line_px(360)
    assert text_px(120) >= 11


def test_letters_beyond_ascii_are_written():
    plain, accented = (np.zeros((40, 200, 3), np.uint8) for _ in range(2))
    put_text(plain, "Ra", (0, 0), 20, (255, 255, 255))
    put_text(accented, "Rä", (0, 0), 20, (255, 255, 255))
    assert plain.any()
    assert np.any(plain != accented)


def test_colours_come_again_and_never_end():
    assert colour_of(3) == colour_of(11)
    assert len({colour_of(number) for number in range(8)}) == 8
