"""Presence of any message on a channel that is read in parts."""

import numpy as np
import pytest

from mtm_audit.significance.presence import channel_nats
from mtm_audit.significance.weighed_channel import weighed
from mtm_onboard.protocol import Codebook
from tests.audit.significance.recorded import prepared, secret, terms_of
from tests.audit.significance.test_sequence import ROLLING


def test_it_does_not_matter_which_part_comes_first():
    """A turning may say what the forward speed of a slow robot hardly does, and the other way round."""
    scores = np.random.default_rng(0).standard_normal((6, 4))
    parts = [
        weighed(terms_of(ROLLING, Codebook(secret(2), ROLLING), prepared(seconds), 6, scores=scores), 0.0)
        for seconds in (10.0, 8.0)
    ]
    assert channel_nats(parts) == pytest.approx(channel_nats(parts[::-1]), abs=1e-9)
