import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_onboard.links.plaintext_messages import (
    Answer,
    PushedHeading,
    PushedPosition,
    PushEnd,
    Splitter,
    numbered,
    parse_piece,
    speed_words,
)
from mtm_onboard.model.velocity import STOP, BodyVelocity

metres_a_second = st.floats(-3.5, 3.5)


def test_a_speed_is_words_in_the_robots_signs():
    assert speed_words(BodyVelocity(0.5, -0.25, math.radians(30))) == "chassis speed x 0.5000 y 0.2500 z -30.000"


def test_a_standstill_has_no_minus_and_no_exponent():
    assert speed_words(STOP) == "chassis speed x 0.0000 y 0.0000 z 0.000"
    assert speed_words(BodyVelocity(-1e-9, 1e-9, 1e-9)) == speed_words(STOP)


def test_a_numbered_command_ends_in_its_number_and_a_semicolon():
    assert numbered("robot mode free", 17) == b"robot mode free seq 17;"


@given(metres_a_second, metres_a_second, st.floats(-10.4, 10.4))
def test_a_speed_comes_through_to_half_a_unit_of_its_last_digit(vx, vy, wz):
    words = speed_words(BodyVelocity(vx, vy, wz)).split(" ")
    assert words[::2] == ["chassis", "x", "y", "z"] or words[:2] == ["chassis", "speed"]
    assert float(words[3]) == pytest.approx(vx, abs=0.500001e-4)
    assert float(words[5]) == pytest.approx(-vy, abs=0.500001e-4)
    assert float(words[7]) == pytest.approx(-math.degrees(wz), abs=0.500001e-3)


@pytest.mark.parametrize("axis", range(3))
@pytest.mark.parametrize(
    ("bad", "sentence"), [(math.nan, "not finite"), (-math.inf, "not finite"), (11.0, "lower the limits")]
)
def test_a_speed_that_the_robot_cannot_take_is_refused(axis, bad, sentence):
    values = [0.1, 0.1, 0.1]
    values[axis] = bad
    with pytest.raises(ValueError, match=sentence):
        speed_words(BodyVelocity(*values))


@pytest.mark.parametrize(
    ("text", "piece"),
    [
        ("ok", Answer(True, None)),
        ("ok seq 5", Answer(True, 5)),
        ("Already in SDK mode", Answer(True, None)),
        ("fail seq 7", Answer(False, 7)),
        ("error", Answer(False, None)),
        ("not in sdk mode seq 8", Answer(False, 8, is_outside=True)),
        ("quit sdk mode failed", Answer(False, None)),
        ("command format error: command parse error seq 12", Answer(False, 12)),
        ("command format error: no seq value", Answer(False, None)),
        ("chassis_speed exec error seq 3", Answer(False, 3)),
        ("chassis push position 1.000 2.000 ", PushedPosition((1.0, -2.0))),
        ("chassis push position 1.000 2.000 30.000 ", PushedPosition((1.0, -2.0))),
        (" attitude 1.000 2.000 90.000 ", PushedHeading(-math.pi / 2)),
        ("chassis push attitude 0.000 0.000 -90.000 ", PushedHeading(math.pi / 2)),
        (" position 0.000 -1.500 ", PushedPosition((0.0, 1.5))),
        ("", PushEnd()),
        (" ", PushEnd()),
    ],
)
def test_what_the_robot_says_is_understood(text, piece):
    assert parse_piece(text) == piece


@pytest.mark.parametrize(
    "text",
    [
        "okay", "ok seq", "ok seq x", "ok seq -1", "ok seq 1 2", "OK", "chassis push position 1.000", "position a b",
        "attitude 1.000 2.000", "position nan nan", "position 1e300 0", "position  1 2", "84 ", "\ufffdok", "ok\n",
        "chassis push position 1 2 3 4", "chassis push", "ok seq " + 40 * "9",
    ],
)  # fmt: skip
def test_what_no_robot_says_is_refused(text):
    with pytest.raises(ValueError, match="."):
        parse_piece(text)


@given(st.text(max_size=80))
def test_any_text_is_a_piece_or_a_value_error(text):
    try:
        piece = parse_piece(text)
    except ValueError:
        return
    if isinstance(piece, PushedPosition):
        assert all(map(math.isfinite, piece.xy_m))


@given(st.lists(st.text("abc 09.-", max_size=30), max_size=10), st.lists(st.integers(0, 200)))
def test_text_in_any_portions_gives_the_same_pieces(texts, cuts):
    stream = "".join(f"{text};" for text in texts).encode()
    splitter, pieces, last = Splitter(), [], 0
    for cut in [*sorted(cuts), len(stream)]:
        pieces += splitter.feed(stream[last:cut])
        last = max(last, cut)
    assert pieces == texts


def test_a_text_without_an_end_is_dropped_and_counted_once():
    splitter = Splitter(longest=10)
    assert [splitter.feed(b"x" * 7) for _ in range(100)] == 100 * [[]]
    assert splitter.feed(b"x;ok;") == ["ok"]
    assert splitter.overlong == 1
    assert splitter.feed(b"0123456789;" + b"01234567890;") == ["0123456789"]
    assert splitter.overlong == 2


def test_a_cleared_splitter_has_forgotten_half_a_text():
    splitter = Splitter()
    splitter.feed(b"chassis speed x 1")
    splitter.clear()
    assert splitter.feed(b"ok;") == ["ok"]


@given(st.binary(max_size=300))
def test_any_bytes_can_be_split(data):
    for piece in Splitter().feed(data):
        assert ";" not in piece
