from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_audit.decoding.message import decode_message
from mtm_onboard.protocol import MtmError
from mtm_onboard.protocol.framing import Framing, decode_frame, encode_frame, frame_order
from tests.audit.decoding.message.simulated import simulated_ratios
from tests.onboard.protocol.framing.framed import (
    FAKE_SECRET,
    OTHER_SECRET,
    framed_scheme,
    payloads,
    schemes,
)

TAGGED = Framing("integer", 16, number_bits=8, check="tag", check_bits=24, code="reed-solomon")
SCHEME = framed_scheme(TAGGED)


def clean_ratios(symbols, scheme):
    ratios = np.zeros((scheme.message_symbols, scheme.alphabet_size))
    ratios[np.arange(len(symbols)), symbols] = 12.0
    return ratios


@given(schemes(), st.data())
def test_a_clean_frame_is_read_at_the_first_try(scheme, data):
    payload = data.draw(payloads(scheme.framing))
    number = data.draw(st.integers(0, 2**scheme.framing.number_bits - 1))
    symbols = encode_frame(payload, scheme, FAKE_SECRET, number=number, epoch=3)
    message = decode_message(clean_ratios(symbols, scheme), scheme, FAKE_SECRET, [3])
    checked = scheme.framing.check != "none"
    assert (message.payload, message.number, message.tried) == (payload, number, 1)
    assert message.epoch == (3 if checked else None)
    assert message.check_passed == checked
    assert message.authenticated == (scheme.framing.check == "tag")
    assert message.false_acceptance == (2.0**-scheme.framing.check_bits if checked else 1.0)
    assert message.log_odds_nats > 0.0
    assert message.posterior > 0.5 or not checked


def count_right(scheme, distance, frames, read):
    draw = np.random.default_rng(5)
    right = 0
    for number in range(frames):
        payload = int(draw.integers(2**16))
        symbols = encode_frame(payload, scheme, FAKE_SECRET, number=number)
        right += read(simulated_ratios(symbols, scheme.alphabet_size, distance, draw, missing=0.1)) == payload
    return right


def soft(scheme):
    return lambda ratios: decode_message(ratios, scheme, FAKE_SECRET, [0]).payload


def hard(scheme):
    def read(ratios):
        symbols = [int(np.argmax(row)) if row.any() else None for row in ratios]
        try:
            return decode_frame(symbols, scheme, FAKE_SECRET).payload
        except MtmError:
            return None

    return read


def test_frames_are_read_where_hard_decisions_fail():
    assert count_right(SCHEME, 2.4, 60, hard(SCHEME)) < 20
    assert count_right(SCHEME, 2.4, 60, soft(SCHEME)) >= 56


def test_a_tag_corrects_without_a_code():
    scheme = framed_scheme(replace(TAGGED, code="none"), counts=(6, 6, 6, 6))
    assert count_right(scheme, 3.4, 40, soft(scheme)) >= 20


def test_the_epoch_is_the_one_under_which_the_tag_holds():
    symbols = encode_frame(4711, SCHEME, FAKE_SECRET, number=9, epoch=20)
    message = decode_message(clean_ratios(symbols, SCHEME), SCHEME, FAKE_SECRET, [19, 20, 21])
    assert (message.payload, message.number, message.epoch, message.tried) == (4711, 9, 20, 2)


@pytest.mark.parametrize(("secret", "epoch"), [(OTHER_SECRET, 0), (FAKE_SECRET, 1)], ids=["key", "epoch"])
def test_a_frame_of_another_key_or_epoch_is_not_authenticated(secret, epoch):
    symbols = encode_frame(4711, SCHEME, secret, epoch=epoch)
    message = decode_message(clean_ratios(symbols, SCHEME), SCHEME, FAKE_SECRET, [0])
    assert (message.payload, message.number, message.epoch) == (None, None, None)
    assert not message.check_passed
    assert not message.authenticated
    assert message.posterior == 0.0
    assert message.log_odds_nats == -np.inf


@pytest.mark.parametrize(("check_bits", "most"), [(16, 16), (20, 256), (40, 1024)])
def test_chance_passes_one_frame_in_4096_at_most(check_bits, most):
    scheme = framed_scheme(Framing("integer", 16, check="tag", check_bits=check_bits))
    nothing = decode_message(np.zeros((48, 4)), scheme, OTHER_SECRET, [0, 1, 2])
    assert nothing.payload is None
    assert nothing.tried <= most * (3 if most == 1024 else 1)
    assert nothing.false_acceptance <= 2.0**-12


def test_a_sure_and_wrong_symbol_does_not_outvote_the_others():
    symbols = encode_frame(4711, SCHEME, FAKE_SECRET)
    ratios = np.zeros((48, 4))
    ratios[np.arange(48), symbols] = 4.0
    ratios[10:14] = 0.0
    ratios[np.arange(10, 14), (np.array(symbols[10:14]) + 1) % 4] = 1000.0
    message = decode_message(ratios, SCHEME, FAKE_SECRET, [0])
    assert message.payload == 4711


def test_occluded_repetitions_add_up_to_a_whole_frame():
    scheme = framed_scheme(replace(TAGGED, interleave=True), schedule="rolling")
    symbols = np.array(encode_frame(4711, scheme, FAKE_SECRET))
    hidden, draw = np.arange(48) < 30, np.random.default_rng(3)
    total, alone = np.zeros((48, 4)), []
    for slot in range(3):
        order = frame_order(scheme, slot)
        played = simulated_ratios(symbols[order], 4, 2.6, draw)
        played[hidden] = 0.0
        seen = np.zeros((48, 4))
        seen[order] = played
        alone.append(decode_message(seen, scheme, FAKE_SECRET, [0]).payload)
        total += seen
    assert alone == [None, None, None]
    assert decode_message(total, scheme, FAKE_SECRET, [0]).payload == 4711


def posteriors_and_truth(framing, distance, frames=200):
    scheme = framed_scheme(framing, counts=(3, 3, 3, 3))
    draw = np.random.default_rng(11)
    posteriors, right = [], []
    for _ in range(frames):
        payload = int(draw.integers(2**framing.payload_bits))
        ratios = simulated_ratios(encode_frame(payload, scheme, FAKE_SECRET), 4, distance, draw)
        message = decode_message(ratios, scheme, FAKE_SECRET, [0])
        posteriors.append(message.posterior)
        right.append(message.payload == payload)
    return np.array(posteriors), np.array(right)


@pytest.mark.parametrize(
    ("framing", "distance"), [(Framing("integer", 24), 3.2), (Framing("integer", 10, code="reed-solomon"), 1.4)]
)
def test_a_full_posterior_is_how_often_the_payload_is_right(framing, distance):
    posteriors, right = posteriors_and_truth(framing, distance)
    assert 0.3 < np.mean(right) < 0.9
    assert np.mean(right) == pytest.approx(np.mean(posteriors), abs=0.07)


def test_the_posterior_of_a_coded_frame_keeps_its_promise():
    posteriors, right = posteriors_and_truth(Framing("integer", 16, code="reed-solomon"), 2.0)
    assert np.mean(posteriors) < np.mean(right)
    assert np.sum(posteriors > 0.9) >= 20
    assert np.mean(right[posteriors > 0.9]) > 0.9


def test_nothing_seen_says_nothing():
    scheme = framed_scheme(Framing("integer", 16, code="reed-solomon"))
    message = decode_message(np.zeros((48, 4)), scheme, FAKE_SECRET, [0])
    assert message.posterior == pytest.approx(2.0**-16, rel=0.1)
    assert message.log_odds_nats == pytest.approx(0.0, abs=1e-9)


def test_what_cannot_be_decoded_is_refused():
    with pytest.raises(MtmError, match="plain numbers and not frames"):
        decode_message(np.zeros((48, 4)), framed_scheme(None), FAKE_SECRET, [0])
    for spoilt in (np.zeros((47, 4)), np.full((48, 4), np.nan)):
        with pytest.raises(MtmError, match=r"of shape \(48, 4\)"):
            decode_message(spoilt, SCHEME, FAKE_SECRET, [0])
    with pytest.raises(MtmError, match="no epoch is given"):
        decode_message(np.zeros((48, 4)), SCHEME, FAKE_SECRET, [])
