from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mtm_audit.model.compression import Compression
from mtm_audit.model.recording import Recording
from mtm_audit.model.track import Track
from mtm_audit.reporting.film_limits import displacement_m, film_limits
from mtm_onboard.protocol import Codebook
from tests.audit.moving_robot import FAKE_SECRET, scheme_of

SCHEME = scheme_of(symbols=(1,), ticks=400)
STILL = Track("marker0", np.arange(3.0), np.zeros((3, 2)), np.ones(3, bool), unit="px")


def filmed(compression):
    return Recording((Path("film.mp4"),), "video", (STILL,), compression=compression)


def quieter(sigma):
    return replace(SCHEME, channels=(replace(SCHEME.channels[0], sigma=sigma),))


@pytest.mark.parametrize("spectrum", [None, ((0.5, -12.0), (5.0, 0.0))], ids=["flat", "slope"])
def test_the_displacement_is_that_of_the_waveforms(spectrum):
    scheme = replace(SCHEME, spectrum=spectrum)
    squares = []
    for number in range(200):
        secret = FAKE_SECRET[:30] + number.to_bytes(2, "big")
        waveform = Codebook(secret, scheme).samples(scheme.channels[0], 0)[0, 0]
        moved_m = 0.1 * np.cumsum(waveform - waveform.mean()) / scheme.rate_hz
        squares.append(np.var(moved_m))
    assert displacement_m(scheme.channels[0], scheme) == pytest.approx(np.sqrt(np.mean(squares)), rel=0.1)


def test_a_loud_message_is_not_lost_where_markers_are_read():
    (said,) = film_limits(filmed(Compression("h264", 0.015, 19.0)), SCHEME)
    assert "H.264 at 0.015 bits a pixel (quantiser 19)" in said
    assert "below 0.05 to 0.07 px" in said
    assert "10 mm" in said
    assert "not lost" in said


def test_a_quiet_message_needs_larger_markers_in_coarser_films():
    fine, coarse = (
        film_limits(filmed(Compression("h264", 0.01, quantiser)), quieter(0.001))[0] for quantiser in (13.0, 33.0)
    )
    assert "is lost unless a marker of 10 cm is 45 px wide or more" in fine
    assert "is lost unless a marker of 10 cm is 179 px wide or more" in coarse


def test_a_codec_without_a_known_quantiser_gets_a_range():
    assert "HEVC" in film_limits(filmed(Compression("hevc", 0.02)), SCHEME)[0]
    assert "below 0.03 to 0.10 px" in film_limits(filmed(Compression("hevc", 0.02)), SCHEME)[0]
    assert "below 0.02 to 0.03 px" in film_limits(filmed(Compression("mjpeg", 0.6)), SCHEME)[0]


def test_motion_capture_and_decoded_films_have_no_such_limit():
    assert film_limits(filmed(None), SCHEME) == ()
