"""How sure a decoded frame is, against Bayes' rule written out for frames that have no code.

Without a code every sequence of symbols is some frame's data, and of those that are not the frame found, one in
2 ** check_bits passes the check under each epoch.
"""

import numpy as np
import pytest

from mtm_audit.decoding.message.message import decode_message
from mtm_onboard.protocol.framing import Framing, encode_frame
from tests.onboard.protocol.framing.framed import FAKE_SECRET, plain_row

OUTLIERS = 0.001


def read(framing, nats, epochs=(0,), payload=77):
    """What is decoded when each symbol that was sent is `nats` likelier than any other, and how likely the frame is."""
    scheme = plain_row(framing, 4, -(-framing.data_bits // 2))
    symbols = encode_frame(payload, scheme, FAKE_SECRET, epoch=epochs[0])
    ratios = np.zeros((len(symbols), 4))
    ratios[np.arange(len(symbols)), symbols] = nats
    each = (1.0 - OUTLIERS) * np.exp(nats) / (np.exp(nats) + 3.0) + OUTLIERS / 4.0
    message = decode_message(ratios, scheme, FAKE_SECRET, epochs)
    assert message.payload == payload
    return message, each ** len(symbols)


@pytest.mark.parametrize("nats", [1.0, 2.0, 5.0])
@pytest.mark.parametrize(("check", "bits"), [("crc", 16), ("tag", 16), ("tag", 20), ("crc", 24), ("tag", 26)])
@pytest.mark.parametrize("epochs", [(0,), (0, 1, 2)])
def test_a_check_of_c_bits_makes_others_two_to_the_c_rarer(nats, check, bits, epochs):
    message, likelihood = read(Framing("integer", 8, check=check, check_bits=bits), nats, epochs)
    others = (1.0 - likelihood) * len(epochs) * 2.0**-bits
    assert message.posterior == pytest.approx(likelihood / (likelihood + others), rel=1e-6)


@pytest.mark.parametrize("nats", [1.0, 2.0, 5.0])
@pytest.mark.parametrize("framing", [Framing("integer", 8), Framing("integer", 8, number_bits=4)])
def test_without_a_check_a_frame_is_as_likely_as_its_symbols(nats, framing):
    message, likelihood = read(framing, nats)
    assert message.posterior == pytest.approx(likelihood, rel=1e-6)
