"""The gateway between a companion and a motion controller."""

import itertools
import struct

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_onboard.firmware.image import ONE
from tests.firmware.shim_gateway import (
    COMPANION,
    CONTROLLER,
    STREAM,
    Board,
    Frame,
    aligned,
    cut,
    on_the_wire,
    speed_message,
    stream,
    whole_messages,
    wire_speeds,
)
from tests.firmware.shim_model import in_q20
from tests.firmware.shim_player import ShimPlayer
from tests.firmware.test_playing import message_image
from tests.firmware.test_wire import FRAMES, built, parsed

LIMITS = in_q20((3.5, 3.5, 10.47))
OTHERS = [frame for frame in FRAMES if frame[9:11] != b"\x3f\x21"]
SPEEDS = [frame for frame in FRAMES if frame[9:11] == b"\x3f\x21"]


def silent(**options):
    return Board(ShimPlayer(50_000, LIMITS), **options)


def playing(**options):
    board = silent(**options)
    assert board.player.offer(message_image()) == 0
    return board


def reference():
    """The core alone, playing the same image from the same moment as `playing` boards."""
    player = ShimPlayer(50_000, LIMITS)
    player.offer(message_image())
    return player


traffic_st = st.lists(st.sampled_from(OTHERS) | st.binary(max_size=20), max_size=12).map(b"".join)


@given(data=traffic_st, size=st.integers(1, 8), seed=st.integers(0, 99))
def test_other_traffic_passes_byte_for_byte_frame_for_frame(data, size, seed):
    rng = np.random.default_rng(seed)
    board = playing()
    frames = [*cut(data, size), Frame(0x202, b"\x55abc"), Frame(0x7FF, b""), *cut(data, 8, 0x202)]
    for at in rng.integers(0, len(frames), 3):
        frames.insert(int(at), Frame(0x80000123, b"other"))
    assert board.pass_on(frames) == frames


@given(speeds=st.lists(st.sampled_from(SPEEDS), min_size=1, max_size=5), size=st.integers(1, 8))
def test_commands_pass_bit_for_bit_when_there_is_no_noise(speeds, size):
    board = silent()
    frames = cut(b"".join(speeds), size)
    within = [all(abs(value) <= 3.5 for value in wire_speeds(message)[:2]) for message in speeds]
    if all(within) and all(abs(wire_speeds(message)[2]) < 599 for message in speeds):
        assert stream(board.pass_on(frames)) == stream(frames)
        assert board.counts.passed == len(speeds)
        assert board.counts.rewritten == 0


@pytest.mark.parametrize("size", range(1, 9))
@pytest.mark.parametrize("lead", range(8))
def test_a_command_gets_the_noise_of_its_tick_however_it_is_cut(size, lead):
    board, core = playing(), reference()
    core.tick(board.now_us, None)
    heartbeat = OTHERS[0]
    before = built(9, 0xC3, 1, 0, 0x3F, 0x60, bytes(lead))
    message = speed_message(0.25, -0.5, 30.0, sequence=7)
    passed = board.pass_on(cut(before + message + heartbeat, size), gap_us=1)
    assert [len(frame.data) for frame in passed] == [len(f.data) for f in cut(before + message + heartbeat, size)]
    first, changed, last = whole_messages(passed)
    assert (first, last) == (before, heartbeat)
    assert changed[:11] == message[:11]
    base = in_q20((0.25, 0.5, -30.0 * np.pi / 180))
    expected = on_the_wire(core.tick(board.now_us, base))
    assert wire_speeds(changed)[:2] == pytest.approx(expected[:2], rel=2**-15, abs=3 / ONE)
    assert wire_speeds(changed)[2] == 30.0
    assert board.counts.rewritten == 1


def test_every_aligned_frame_leaves_as_soon_as_it_has_come():
    board = playing()
    for frame in aligned(speed_message(0.3, 0.2, -10.0)) + aligned(OTHERS[3]):
        assert len(board.pass_on([frame])) == 1


def test_a_packed_frame_waits_for_one_other_at_most():
    board = playing()
    for lead in range(8):
        frames = cut(built(9, 0xC3, 1, 0, 0x3F, 0x60, bytes(lead)) + speed_message(0.3, 0.2, -10.0) + OTHERS[0], 8)
        before = len(board.sent[CONTROLLER])
        for given_frames, frame in enumerate(frames, 1):
            board.pass_on([frame])
            assert given_frames - (len(board.sent[CONTROLLER]) - before) in (0, 1)


def test_sequence_and_order_are_kept_in_a_long_mixed_stream():
    rng = np.random.default_rng(3)
    board = playing()
    messages = [
        speed_message(*rng.uniform(-1, 1, 3), sequence=number) if rng.random() < 0.4 else OTHERS[number % len(OTHERS)]
        for number in range(300)
    ]
    passed = parsed(stream(board.pass_on(cut(b"".join(messages), 8))))
    assert [message[:11] for message in passed] == [message[:11] for message in messages]
    for sent, received in zip(messages, passed, strict=True):
        if sent[9:11] != b"\x3f\x21":
            assert received == sent
    assert board.counts.rewritten + board.counts.passed == sum(m[9:11] == b"\x3f\x21" for m in messages)


def test_an_early_low_byte_costs_less_than_2_to_the_minus_16():
    board, core = playing(), reference()
    core.tick(board.now_us, None)
    for number in range(50):
        base = np.float32(0.37 + number / 100)
        core_out = core.tick(board.now_us, in_q20((0.0, -float(base), 0.0)))
        (message,) = whole_messages(board.pass_on(aligned(speed_message(0.0, base, 0.0)), gap_us=0))
        assert message[15] == struct.pack("<f", base)[0]
        assert wire_speeds(message)[1] == pytest.approx(-core_out[1] / ONE, rel=2**-16, abs=1 / ONE)
        board.now_us += 20_000


def test_a_broken_checksum_stays_broken_and_counts_for_nothing():
    for bit in range(16):
        board = playing()
        message = bytearray(speed_message(0.3, 0.2, -10.0))
        message[23 + bit // 8] ^= 1 << (bit % 8)
        assert whole_messages(board.pass_on(aligned(bytes(message)))) == []
        assert board.player.shim.age_us == 2**32 - 1


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_a_command_that_is_no_number_becomes_the_last_good_one(bad):
    board = silent()
    board.pass_on(aligned(speed_message(0.5, 0.25, 30.0)))
    (message,) = whole_messages(board.pass_on(aligned(speed_message(bad, bad, bad, sequence=1))))
    assert wire_speeds(message) == pytest.approx((0.5, 0.25, 30.0), rel=1e-4)
    assert board.player.counts.refused_commands == 1


def test_speeds_beyond_the_limits_are_cut():
    board = silent()
    (message,) = whole_messages(board.pass_on(aligned(speed_message(5.0, -7.0, 1e30))))
    assert wire_speeds(message) == pytest.approx((3.5, -3.5, 10.47 * 180 / np.pi), rel=1e-5)


def test_without_commands_the_gateway_fades_to_zero_and_says_so():
    board = playing()
    board.pass_on(aligned(speed_message(0.5, 0.0, 0.0, sequence=77)))
    assert board.run(95_000) == []
    fading = [wire_speeds(message)[0] for message in board.run(155_000)]
    assert len(fading) in (7, 8)
    assert all(earlier > later for earlier, later in itertools.pairwise(fading))
    resting = board.run(200_000)
    assert len(resting) == 10
    assert {wire_speeds(message) for message in resting} == {(0.0, 0.0, 0.0)}
    assert {message[4:8] for message in resting} == {b"\xc9\xc3\x4d\x00"}


def test_the_gateway_is_silent_before_the_first_command():
    assert playing().run(1_000_000) == []


@pytest.mark.parametrize("other", [(0x20, bytes(8)), (0x22, bytes(12)), (0x25, bytes(13)), (0x19, b"\0")])
def test_another_kind_of_motion_takes_over_from_speed_commands(other):
    cmdid, payload = other
    board = playing()
    board.pass_on(aligned(speed_message(0.5, 0.0, 0.0)))
    board.pass_on(aligned(built(0xC9, 0xC3, 1, 0, 0x3F, cmdid, payload)))
    assert board.run(500_000) == []


def test_work_mode_1_does_not_end_the_watch_over_speed_commands():
    board = playing()
    board.pass_on(aligned(speed_message(0.5, 0.0, 0.0)))
    board.pass_on(aligned(built(9, 0xC3, 1, 0x40, 0x3F, 0x19, b"\1")))
    assert board.run(500_000) != []


def test_stop_is_said_at_once_and_turns_commands_to_zero():
    board = playing()
    board.pass_on(aligned(speed_message(0.5, 0.1, 20.0)))
    board.stop = True
    assert [wire_speeds(message) for message in board.run(1000)] == [(0.0, 0.0, 0.0)]
    board.stop = False
    (message,) = whole_messages(board.pass_on(aligned(speed_message(0.5, 0.1, 20.0))))
    assert wire_speeds(message) == pytest.approx((0.0, 0.0, 0.0), abs=1e-30)
    assert len(board.run(100_000)) == 5


@pytest.mark.parametrize("cmdid", [0x20, 0x22, 0x25])
def test_while_stopped_other_commands_arrive_unreadable(cmdid):
    board = playing()
    motion = built(0xC9, 0xC3, 1, 0, 0x3F, cmdid, bytes(8))
    assert whole_messages(board.pass_on(aligned(motion))) == [motion]
    board.stop = True
    board.run(1000)
    passed = board.pass_on(aligned(motion), gap_us=0)
    assert len(stream(passed)) == len(motion)
    assert whole_messages(passed) == []
    inverted = motion[:-2] + bytes(0xFF ^ byte for byte in motion[-2:])
    assert whole_messages(board.pass_on(aligned(inverted), gap_us=0)) == []
    assert board.counts.spoilt == 2


def test_stop_cuts_in_when_a_sender_is_always_inside_a_message():
    board = playing()
    heartbeat = built(9, 0xC3, 1, 0, 0x3F, 0x60, bytes(14))
    board.pass_on(cut(heartbeat + speed_message(0.5, 0, 0), 8)[:-1])
    board.stop = True
    messages = board.run(60_000)
    assert wire_speeds(messages[-1]) == (0.0, 0.0, 0.0)


def heartbeat(number: int) -> bytes:
    return built(9, 0xC3, number & 0xFFFF, 0, 0x3F, 0x60, bytes(14))


class Packed:
    """A sender that fills each frame before it begins the next, whatever message a byte is of."""

    def __init__(self, board: Board) -> None:
        self.board = board
        self._rest = b""

    def say(self, message: bytes) -> None:
        data = self._rest + message
        whole = len(data) // 8 * 8
        self._rest = data[whole:]
        self.board.pass_on(cut(data[:whole], 8))


@pytest.mark.parametrize("fill", [False, True])
def test_a_packed_sender_loses_no_message_to_the_gateway_s_own(fill):
    board = playing(fill=fill)
    sender = Packed(board)
    sender.say(speed_message(0.5, 0.0, 0.0))
    told = [heartbeat(number) for number in range(300)]
    for message in told:
        sender.say(message)
        board.run(10_000 - 4 * 130, 790)
    heard = whole_messages(board.sent[CONTROLLER])
    assert [message for message in heard if message[10] == 0x60] == told[: len(told) - 1]
    own = [message for message in heard if message[9:11] == b"\x3f\x21"]
    # From 0.1 s on, or from the first one with fill, one each 20 ms for the three seconds.
    assert len(own) >= (145 if fill else 140)
    assert wire_speeds(own[-1]) == (0.0, 0.0, 0.0)


def test_a_held_beginning_leaves_with_the_frame_after_it():
    board = playing()
    sender = Packed(board)
    sender.say(speed_message(0.5, 0.0, 0.0))
    board.run(300_000)
    for number in range(20):
        sender.say(heartbeat(number))
        board.pass_on([Frame(0x7FF, bytes([number]))])
        board.run(5_000)
    others = [frame.data[0] for frame in board.sent[CONTROLLER] if frame.id == 0x7FF]
    assert others == sorted(others)
    sender.say(heartbeat(20))
    board.run(1000)
    heard = [message for message in whole_messages(board.sent[CONTROLLER]) if message[10] == 0x60]
    assert heard == [heartbeat(number) for number in range(len(heard))]
    assert len(heard) >= 20


def test_a_held_beginning_holds_up_no_frame_of_another_id():
    board = playing()
    board.pass_on(aligned(speed_message(0.5, 0.0, 0.0)))
    board.run(300_000)
    frames = cut(heartbeat(0) + heartbeat(1), 8)
    board.pass_on(frames[:4])  # the last of them holds the beginning of the second
    for number in range(50):
        frame = Frame(0x7FF, bytes([number]))
        assert frame in board.pass_on([frame])
        board.run(7_000)
    board.pass_on(frames[4:])
    heard = [message for message in whole_messages(board.sent[CONTROLLER]) if message[10] == 0x60]
    assert heard == [heartbeat(0), heartbeat(1)]


def test_a_packed_sender_s_frames_pass_uncut_while_fresh():
    board = silent()
    frames = cut(speed_message(0.5, 0.0, 0.0) + heartbeat(0) + speed_message(0.5, 0.0, 0.0) + heartbeat(1), 8)
    assert len(board.pass_on(frames)) == len(frames)


def test_a_sender_silent_inside_a_value_is_brought_to_rest():
    board = playing()
    board.pass_on(aligned(speed_message(0.5, 0.0, 0.0)))
    lead = built(9, 0xC3, 1, 0, 0x3F, 0x60, bytes(2))
    board.pass_on(cut(lead + speed_message(0.5, 0.5, 0.5), 8)[:-1])
    resting = board.run(400_000)
    assert wire_speeds(resting[-1]) == (0.0, 0.0, 0.0)


def test_a_command_hidden_by_a_lost_frame_is_counted():
    board = playing()
    board.stop = True
    board.run(1000)
    lost = aligned(built(9, 0xC3, 1, 0, 0x3F, 0x60, bytes(20)))
    command = speed_message(0.5, 0.0, 0.0)
    passed = board.pass_on(lost[:1] + lost[2:3] + aligned(command) + aligned(OTHERS[0]))
    assert board.counts.late == 1
    hidden, answer, after = parsed(stream(passed))
    assert (hidden, after) == (command, OTHERS[0])
    assert wire_speeds(answer) == (0.0, 0.0, 0.0)


def test_fill_plays_every_tick_between_the_companions_commands():
    board, core = playing(fill=True), reference()
    core.tick(board.now_us, None)
    board.pass_on(aligned(speed_message(0.5, 0.0, 0.0)), gap_us=0)
    base = in_q20((0.5, 0, 0))
    core.tick(board.now_us, base)
    heard = [wire_speeds(message)[0] for message in board.run(90_000)]
    expected = [core.tick(board.now_us - 90_000 + 10_000 + 20_000 * tick, None)[0] / ONE for tick in range(4)]
    assert heard[:4] == pytest.approx(expected, abs=2 / ONE)


def test_frames_wait_in_order_while_the_line_is_full():
    board = playing(room=0)
    frames = aligned(b"".join(OTHERS[:9]))
    board.arriving[COMPANION].extend(frames)
    board.arriving[CONTROLLER].extend([Frame(0x202, bytes([n])) for n in range(9)])
    for _ in range(3 * len(frames)):
        board.poll()
        board.room = 1
    board.room = 100
    board.poll()
    board.poll()
    assert board.sent[CONTROLLER] == frames
    assert board.sent[COMPANION] == [Frame(0x202, bytes([n])) for n in range(9)]


def test_a_frame_of_more_than_eight_bytes_is_dropped():
    board = playing()
    assert board.pass_on([Frame(STREAM, bytes(9)), Frame(STREAM, b"ab")]) == [Frame(STREAM, b"ab")]
    assert board.counts.overlong == 1


def test_a_value_changed_too_late_makes_its_command_unreadable():
    board = playing()
    lead = built(9, 0xC3, 1, 0, 0x3F, 0x60, bytes(2))
    frames = cut(lead + speed_message(0.5, 0.5, 0.5), 8)
    at = next(i for i, frame in enumerate(frames) if len(board.pass_on([frame])) == 0)
    assert len(board.pass_on([Frame(0x7FF, b"")] * 7)) == 8
    assert whole_messages(board.pass_on(frames[at + 1 :])) == []


def test_acknowledgements_and_encrypted_messages_are_no_commands():
    board = playing()
    for attributes in (0x80, 0x01):
        frames = aligned(speed_message(0.5, 0.25, 0.0, attributes=attributes))
        assert board.pass_on(frames) == frames


def test_the_board_hears_from_every_poll():
    board = playing()
    board.run(10_000)
    assert board.alive == 10
