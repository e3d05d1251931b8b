import os

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_onboard.model.velocity import BodyVelocity
from mtm_onboard.protocol import MtmError
from mtm_onboard.runtime.base_command import LONGEST_BYTES, StopRequest, parse, velocity_text
from mtm_onboard.runtime.source import NOTHING_YET, Command, HeldSource, StdinSource

FIRST, SECOND = BodyVelocity(0.3, 0.0, -0.5), BodyVelocity(-0.1, 0.2, 0.0)
finite = st.floats(allow_nan=False, allow_infinity=False)


@pytest.fixture
def piped():
    reader, writer = os.pipe()
    source = StdinSource(reader)
    source.poll(0.0)
    with open(writer, "wb", buffering=0) as end:
        yield source, end
    os.close(reader)


@given(st.builds(BodyVelocity, finite, finite, finite))
def test_a_velocity_survives_its_text_exactly(velocity):
    assert parse(velocity_text(velocity)) == velocity
    assert len(velocity_text(velocity)) <= LONGEST_BYTES


@given(st.binary(max_size=200) | st.text("v0123456789.+-eEnaifx_ \n", max_size=140).map(str.encode))
def test_any_bytes_are_a_finite_velocity_or_a_stop_or_refused(data):
    try:
        command = parse(data)
    except MtmError:
        return
    assert isinstance(command, StopRequest) or command.is_finite()


@pytest.mark.parametrize(
    "text",
    [b"", b"v 1 2", b"v 1 2 3 4", b"v nan 0 0", b"v inf 0 0", b"v 1e999 0 0", b"v 1_0 0 0", b"V 1 0 0", b"stop now",
     b"v 0x1 0 0", b"v 1 0 0\nv 2 0 0", b"v 1 0 0" + b" " * 200],
)  # fmt: skip
def test_what_is_no_command_is_refused(text):
    with pytest.raises(MtmError):
        parse(text)


def test_a_held_source_gives_what_was_set_last():
    source = HeldSource()
    assert source.poll(0.0) == NOTHING_YET
    source.set(FIRST, 1.0)
    source.set(SECOND, 1.5)
    assert source.poll(2.0) == Command(SECOND, 1.5, False)
    source.stop()
    source.set(FIRST, 3.0)
    assert source.poll(3.0) == Command(FIRST, 3.0, True)


def test_the_newest_line_counts_and_half_a_line_waits(piped):
    source, end = piped
    end.write(b"v 0.3 0 -0.5\r\nv -0.1 0.")
    assert source.poll(0.02) == Command(FIRST, 0.02, False)
    end.write(b"2 0\nrubbish\n")
    assert source.poll(0.04) == Command(SECOND, 0.04, False)
    assert source.refused == 1
    end.write(b"stop\n")
    assert source.poll(0.06).stop


def test_an_endless_line_is_counted_once_and_forgotten(piped):
    source, end = piped
    for _ in range(5):
        end.write(b"v" * 1000)
        source.poll(0.02)
    end.write(b" 9 9 9\nv 0.3 0 -0.5\n")
    assert source.poll(0.04) == Command(FIRST, 0.04, False)
    assert source.refused == 1


def test_the_end_of_the_input_leaves_the_last_command_to_age(piped):
    source, end = piped
    end.write(b"v 0.3 0 -0.5\n")
    end.close()
    assert [source.poll(now_s) for now_s in (0.02, 0.04)] == [Command(FIRST, 0.02, False)] * 2


def test_an_input_that_was_never_open_has_ended():
    reader, writer = os.pipe()
    os.close(reader)
    os.close(writer)
    assert StdinSource(reader).poll(0.0) == NOTHING_YET
