import can
import pytest

from hil.wires.can_line import can_line


def frame(number):
    return can.Message(arbitration_id=number, is_extended_id=False, data=b"\x01")


def test_frames_reach_the_other_end_in_order_and_not_their_own():
    one, two = can_line()
    one.send(frame(1))
    one.send(frame(2))
    two.send(frame(3))
    assert [two.recv(0).arbitration_id, two.recv(0).arbitration_id, two.recv(0)] == [1, 2, None]
    assert [one.recv(0).arbitration_id, one.recv(0)] == [3, None]


def test_an_end_that_is_shut_down_refuses_as_python_can_does():
    one, two = can_line()
    one.send(frame(1))
    one.shutdown()
    one.shutdown()
    for use in (lambda: one.send(frame(2)), lambda: one.recv(0)):
        with pytest.raises(can.CanOperationError, match="shut down"):
            use()
    assert two.recv(0).arbitration_id == 1
