"""Checksums, DJI messages and single precision in C, against frames of other makers and against Python."""

import json
import math
import struct
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from hil.vehicles.shim_library import load_shim
from mtm_onboard.firmware.image import MAX_Q20, ONE

FRAMES = [bytes.fromhex(entry["hex"]) for entry in json.loads((Path(__file__).parent / "duml_frames.json").read_text())]
messages_st = st.lists(st.sampled_from(FRAMES), max_size=6)


def parsed(data):
    """Every message that the parser finds in `data`, given byte by byte."""
    ffi, lib = load_shim()
    parser = ffi.new("mtm_duml_parser *")
    lib.mtm_duml_init(parser)
    found = []
    for byte in data:
        lib.mtm_duml_push(parser, byte)
        while length := lib.mtm_duml_take(parser):
            found.append(bytes(parser.bytes[0:length]))
    return found


def built(sender, receiver, sequence, attributes, cmdset, cmdid, payload):
    ffi, lib = load_shim()
    message = ffi.new("uint8_t[]", len(payload) + 13)
    head = ffi.new("mtm_duml_head *", [sender, receiver, sequence, attributes, cmdset, cmdid])
    length = lib.mtm_duml_build(message, head, payload, len(payload))
    return bytes(ffi.buffer(message, length))


def test_checksums_have_their_catalogue_values():
    lib = load_shim().lib
    assert lib.mtm_crc8(b"123456789", 9) == 0xFB
    assert lib.mtm_crc16(b"123456789", 9) == 0x7109
    assert lib.mtm_crc32(b"123456789", 9) == 0xCBF43926
    assert (lib.mtm_crc8(b"", 0), lib.mtm_crc16(b"", 0), lib.mtm_crc32(b"", 0)) == (0x77, 0x3692, 0)


def test_frames_of_other_makers_are_parsed_and_built_again():
    assert parsed(b"".join(FRAMES)) == FRAMES
    for frame in FRAMES:
        sender, receiver, sequence, attributes, cmdset, cmdid = struct.unpack_from("<BBHBBB", frame, 4)
        assert built(sender, receiver, sequence, attributes, cmdset, cmdid, frame[11:-2]) == frame


@given(payload=st.binary(max_size=1010), sequence=st.integers(0, 0xFFFF))
@example(payload=bytes(1010), sequence=0)
def test_what_is_built_is_parsed(payload, sequence):
    message = built(0xC9, 0xC3, sequence, 0, 0x3F, 0x21, payload)
    assert parsed(message) == [message]
    assert parsed(b"\x55\x00" + message) == [message]


def test_a_payload_that_is_too_long_is_not_built():
    assert built(0, 0, 0, 0, 0, 0, bytes(1011)) == b""


@given(before=messages_st, garbage=st.binary(max_size=40), after=messages_st)
def test_messages_after_garbage_are_found_once_enough_has_come(before, garbage, after):
    # A header by chance may swallow up to 1023 bytes, and gives them back when its checksum fails.
    found = parsed(b"".join(before) + garbage + b"".join(after) + bytes(1023))
    assert found[: len(before)] == before
    assert [message for message in found[len(before) :] if message in after] == after or b"\x55" in garbage


@given(frame=st.sampled_from(FRAMES), where=st.integers(0, 10_000), bit=st.integers(0, 7))
def test_a_message_with_a_flipped_bit_is_not_passed_on(frame, where, bit):
    broken = bytearray(frame)
    broken[where % len(frame)] ^= 1 << bit
    assert parsed(bytes(broken) + bytes(1023)) == []


@given(st.lists(messages_st.map(b"".join) | st.binary(max_size=64), max_size=8).map(b"".join))
def test_every_message_found_stands_in_the_stream_in_its_order(data):
    at = 0
    for message in parsed(data):
        at = data.index(message, at) + len(message)


@given(st.floats(width=32))
@example(1024.0)
@example(-1023.99993896484375)
@example(2.0**-21)
@example(np.nextafter(np.float32(2.0**-21), np.float32(0)).item())
@example(1e-45)
def test_single_precision_becomes_the_nearest_unit(value):
    bits = struct.unpack("<I", struct.pack("<f", value))[0]
    found = load_shim().lib.mtm_q20_of_f32(bits)
    if not math.isfinite(value):
        assert found == -(2**31)
    elif abs(value) >= 1024:
        assert found == math.copysign(MAX_Q20, value)
    else:
        assert found == math.copysign(math.floor(abs(value) * ONE + 0.5), value)


@given(st.integers(-MAX_Q20, MAX_Q20))
@example(0)
@example((1 << 25) + 1)
@example((1 << 25) + 3)
@example((1 << 30) - 1)
def test_units_become_the_nearest_single_precision(value):
    bits = load_shim().lib.mtm_f32_of_q20(value)
    assert struct.unpack("<f", struct.pack("<I", bits))[0] == np.float32(value / ONE)


@given(st.integers(-(1 << 24), 1 << 24))
def test_what_single_precision_holds_goes_there_and_back(value):
    lib = load_shim().lib
    assert lib.mtm_q20_of_f32(lib.mtm_f32_of_q20(value)) == value


def test_a_message_longer_than_any_is_not_waited_for():
    message = built(0xC9, 0xC3, 1, 0, 0x3F, 0x21, bytes(12))
    longest = built(0xC9, 0xC3, 1, 0, 0, 0, bytes(1010))
    assert parsed(longest[:-1] + message + b"\0") == [message]


@pytest.mark.parametrize("length", [0, 12])
def test_a_header_that_states_less_than_a_message_is_passed_over(length):
    lib = load_shim().lib
    header = bytes([0x55, length, 0x04])
    header += bytes([lib.mtm_crc8(header, 3)])
    message = built(0xC9, 0xC3, 1, 0, 0x3F, 0x21, bytes(12))
    assert parsed(header + message) == [message]
