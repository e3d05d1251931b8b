import numpy as np
import pytest

from mtm_audit.drawing.sheet import contact_sheet


def test_pictures_stand_in_their_order_in_rows():
    pictures = [np.full((30, 40, 3), 50 + 10 * number, np.uint8) for number in range(5)]
    sheet = contact_sheet(pictures, ["header"], columns=3)
    shown = [value for value in range(50, 100, 10) if np.count_nonzero(np.all(sheet == value, axis=2)) >= 30 * 40]
    places = [np.median(np.argwhere(np.all(sheet == value, axis=2)), axis=0) for value in shown]
    assert shown == [50, 60, 70, 80, 90]
    assert [round(place[0] / 38) for place in places] == [1, 1, 1, 2, 2]
    assert places[0][1] < places[1][1] < places[2][1]


def test_a_sheet_of_nothing_is_an_error():
    with pytest.raises(ValueError, match="needs a picture"):
        contact_sheet([], ["header"])
