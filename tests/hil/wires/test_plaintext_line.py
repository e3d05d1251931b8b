import pytest

from hil.wires.plaintext_line import plaintext_line
from mtm_onboard.model.velocity import BodyVelocity
from mtm_onboard.protocol import MtmError


def test_what_one_end_says_is_there_for_the_other_at_once():
    transport, port = plaintext_line()
    transport.open()
    assert port.receive().startswith(b"command;")
    transport.send(BodyVelocity(0.5, 0.0, 0.0))
    assert port.receive() == b"chassis speed x 0.5000 y 0.0000 z 0.000 seq 4;"
    port.answer(b"ok seq 4;")
    transport.service(0.0)
    assert transport.unanswered == 0
    transport.close()
    assert port.receive() is None
    port.shutdown()


def test_a_line_serves_for_one_opening():
    transport, port = plaintext_line()
    transport.open()
    transport.close()
    with pytest.raises(MtmError, match="closed|could not be sent"):
        transport.open()
    port.shutdown()
