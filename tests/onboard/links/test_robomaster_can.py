import errno
import math
import threading
from collections import Counter, deque
from types import SimpleNamespace

import can
import pytest

from hil.fleet.clock import AnsweringClock, SimulatedClock
from hil.vehicles.can_node import CanMotionController
from hil.vehicles.motion_controller import MotionController
from hil.wires.slcan_port import SlcanPort
from mtm_onboard.links.base import LinkBusyError
from mtm_onboard.links.duml import WANTS_ACK, Parser, encode, segment
from mtm_onboard.links.robomaster_can import RoboMasterCan
from mtm_onboard.links.robomaster_messages import WORK_MODE
from mtm_onboard.model.velocity import STOP, BodyVelocity
from mtm_onboard.protocol import MtmError
from tests.hil.vehicles.floating_plant import FloatingPlant
from tests.onboard.links.can_rig import LineRig, VirtualRig, can_rig
from tests.onboard.links.conformance import LinkConformance, Rig

FORWARD = BodyVelocity(0.5, 0.0, 0.0)


def frames(message):
    """What the robot puts on the bus to say `message`."""
    return [can.Message(arbitration_id=0x202, is_extended_id=False, data=data) for data in segment(encode(message))]


class TestRoboMasterCanConforms(LinkConformance):
    @pytest.fixture(params=[VirtualRig, LineRig])
    def rig(self, request):
        with can_rig(request.param) as rig:
            yield Rig(
                rig.transport, rig.controller, rig.plant, rig.clock, lambda: sum(map(len, rig.sent())),
                refuse=rig.refuse, clog=rig.clog, cut=rig.cut, mend=rig.mend, remake=rig.remake,
            )  # fmt: skip


class BrokenBus:
    """Refuses the frames whose numbers are in `refused`, keeps the others, and answers as a willing robot does."""

    def __init__(self, refused):
        self.refused = refused
        self.tried = 0
        self.kept = []
        self.is_shut_down = False
        self._heard, self._said = Parser(), deque()

    def send(self, msg, timeout=None):
        self.tried += 1
        if self.tried in self.refused:
            raise can.CanOperationError("bus off")
        self.kept.append(msg)
        for message in self._heard.feed(msg.data):
            if message.attributes & WANTS_ACK:
                self._said.extend(frames(message.answer(b"\x00")))

    def recv(self, timeout=None):
        return self._said.popleft() if self._said else None

    def shutdown(self):
        self.is_shut_down = True


OPENING_FRAMES = 2 + 3 + 6 + 2 + 4  # unsubscribe, add node, subscribe, work mode, zero speed


def commands(frames):
    messages = Parser().feed(b"".join(bytes(frame.data) for frame in frames))
    return [(message.cmdset, message.cmdid, message.payload) for message in messages]


RELEASE = [(0x3F, 0x21, bytes(12)), (0x3F, 0x19, b"\x00")]


def test_opening_subscribes_engages_and_stands_still():
    with can_rig() as rig:
        rig.transport.open()
        assert [command[:2] for command in commands(rig.sent()) if command[1] != 0x60] == [
            (0x48, 0x04),
            (0x48, 0x01),
            (0x48, 0x03),
            (0x3F, 0x19),
            (0x3F, 0x21),
        ]


def test_every_message_starts_a_frame_of_its_own():
    with can_rig() as rig, rig.transport:
        rig.transport.send(FORWARD)
        rig.run(0.1)
        starts = [frame for frame in rig.sent() if frame.data[0] == 0x55]
        assert len(starts) == len(commands(rig.sent()))
        assert all(frame.arbitration_id == 0x201 and not frame.is_extended_id for frame in rig.sent())


def test_a_heartbeat_goes_out_each_ten_milliseconds():
    with can_rig() as rig, rig.transport:
        rig.run(1.0)
        messages = Parser().feed(b"".join(bytes(frame.data) for frame in rig.sent()))
        beats = [message for message in messages if message.cmdid == 0x60]
        assert len(beats) == rig.transport.heartbeats == 101
        # The work mode runs between the same two hosts and took number 0.
        assert [beat.sequence for beat in beats] == list(range(1, 102))
        assert rig.node.heartbeats >= 99


def test_missed_heartbeats_are_skipped_and_counted():
    transport = RoboMasterCan(BrokenBus(()))
    transport.open()
    for now_s in (5.0, 5.004, 5.057, 5.059, 5.061):
        transport.service(now_s)
    assert (transport.heartbeats, transport.missed_heartbeats) == (3, 4)


def test_a_service_of_uneven_lateness_misses_no_heartbeat():
    transport = RoboMasterCan(BrokenBus(()))
    transport.open()
    lates_s = [0.002, 0.0001, 0.001, 0.0, 0.0015]
    for beat in range(100):
        transport.service(0.01 * beat + lates_s[beat % 5])
    assert (transport.heartbeats, transport.missed_heartbeats) == (100, 0)


def test_time_without_a_link_counts_no_missed_heartbeats():
    with can_rig() as rig:
        rig.run(1.0)
        for _ in range(2):
            with rig.transport:
                rig.run(0.1)
            rig.run(1.0)
        # A hundredth of a second until the robot has answered belongs to each.
        assert 2 * (1 + 10) <= rig.transport.heartbeats <= 2 * (2 + 10)
        assert rig.transport.missed_heartbeats == 0


def test_telemetry_comes_back_in_rep_103_with_both_times():
    with can_rig() as rig, rig.transport:
        assert rig.transport.telemetry is None
        for _ in range(50):
            rig.transport.send(BodyVelocity(0.25, 0.5, 0.5))
            rig.run(0.02)
        told = rig.transport.telemetry
        # The node is polled before the transport is served, at the same instants.
        assert told.received_s == pytest.approx(told.robot_time_s, abs=1e-6)
        assert rig.clock.now() - told.robot_time_s <= 0.02
        assert told.velocity_body_mps == (0.25, 0.5)
        assert told.heading_rad == pytest.approx(rig.plant.heading_rad, abs=0.02)
        assert told.position_xy_m == pytest.approx(rig.plant.position_xy_m, abs=0.02)
        cosine, sine = math.cos(told.heading_rad), math.sin(told.heading_rad)
        assert told.velocity_start_mps == pytest.approx((0.25 * cosine - 0.5 * sine, 0.25 * sine + 0.5 * cosine))
        assert rig.transport.refusals == 0
        assert rig.transport.malformed_pushes == 0


def test_a_bus_error_in_send_is_one_sentence_and_counted():
    bus = BrokenBus({OPENING_FRAMES + 1})
    transport = RoboMasterCan(bus)
    transport.open()
    with pytest.raises(MtmError, match=r"refused a frame \(bus off"):
        transport.send(FORWARD)
    assert transport.bus_errors == 1
    transport.send(FORWARD)


def test_stop_tries_again_until_both_commands_are_out():
    bus = BrokenBus({OPENING_FRAMES + number for number in (1, 3, 8)})
    transport = RoboMasterCan(bus)
    transport.open()
    del bus.kept[:]
    transport.stop()
    assert commands(bus.kept) == RELEASE
    assert transport.bus_errors == 3


def test_a_stop_that_cannot_be_sent_still_releases_the_bus():
    bus = BrokenBus(range(OPENING_FRAMES + 1, 10_000))
    with pytest.raises(MtmError, match="switch the robot off"), RoboMasterCan(bus):
        pass
    assert bus.tried == OPENING_FRAMES + 10
    assert bus.is_shut_down


def test_an_opening_that_fails_half_way_releases_the_bus():
    bus = BrokenBus({OPENING_FRAMES})
    with pytest.raises(MtmError, match="refused a frame"):
        RoboMasterCan(bus).open()
    assert commands(bus.kept)[-2:] == RELEASE
    assert bus.is_shut_down


def test_a_bus_error_in_a_heartbeat_does_not_end_the_service():
    bus = BrokenBus({OPENING_FRAMES + 1})
    transport = RoboMasterCan(bus)
    transport.open()
    transport.service(0.0)
    transport.service(0.01)
    assert (transport.bus_errors, transport.heartbeats, transport.missed_heartbeats) == (1, 1, 1)


class SlowBus(BrokenBus):
    """Takes each frame only after its whole timeout, or not even then when it is `full`."""

    def __init__(self, *, full):
        super().__init__(())
        self.is_slow = False
        self._full = full
        self.now_s = 0.0

    def send(self, msg, timeout=None):
        if not self.is_slow:
            return super().send(msg, timeout)
        self.now_s += timeout
        if self._full:
            raise can.CanOperationError("Could not write to serial device")
        return super().send(msg, timeout)


@pytest.mark.parametrize("full", [True, False])
def test_a_slow_bus_holds_a_command_no_longer_than_the_bound(monkeypatch, full):
    bus = SlowBus(full=full)
    monkeypatch.setattr("mtm_onboard.links.can_stream.time.monotonic", lambda: bus.now_s)
    transport = RoboMasterCan(bus)
    transport.open()
    bus.is_slow = True
    if full:
        with pytest.raises(LinkBusyError, match="no frame in time"):
            transport.send(FORWARD)
        assert bus.now_s == pytest.approx(transport.write_bound_s)
    else:
        transport.send(FORWARD)
        # Each of four frames may wait a millisecond even when there is no time left, so that none is cut in two.
        assert bus.now_s <= transport.write_bound_s + 0.004
    bus.is_slow = False
    transport.send(FORWARD)


def test_a_full_transmit_queue_is_a_busy_bus_and_no_broken_one():
    class FullQueue(BrokenBus):
        def send(self, msg, timeout=None):
            if self.refused:
                raise can.CanOperationError("Failed to transmit: No buffer space available", errno.ENOBUFS)
            super().send(msg, timeout)

    bus = FullQueue(())
    transport = RoboMasterCan(bus)
    transport.open()
    bus.refused = True
    with pytest.raises(LinkBusyError, match="No buffer space"):
        transport.send(FORWARD)
    bus.refused = ()
    transport.send(FORWARD)


def test_a_serial_adapter_is_never_waited_for(monkeypatch):
    port = SlcanPort()
    node = CanMotionController(MotionController(FloatingPlant()), port)
    clock = AnsweringClock(SimulatedClock(), node.poll)
    transport = RoboMasterCan(interface="slcan", channel=port.path, sleep_after_open=0, clock=clock)
    transport.open()
    monkeypatch.setattr("serial.serialposix.termios.tcdrain", lambda _: pytest.fail("waited without bound"))
    transport.send(FORWARD)
    monkeypatch.undo()
    transport.stop()
    transport.close()
    port.shutdown()


def test_an_adapter_that_takes_no_farewell_is_released():
    class Gone(BrokenBus):
        def shutdown(self):
            raise can.CanOperationError("Could not write to serial device")

    bus, closed = Gone(()), []
    bus.serialPortOrig = SimpleNamespace(close=lambda: closed.append(True))
    with RoboMasterCan(bus):
        pass
    assert closed == [True]


def test_a_command_does_not_wait_for_a_stuck_heartbeat():
    transport = RoboMasterCan(BrokenBus(()))
    transport.open()
    with vars(transport)["_lock"], pytest.raises(LinkBusyError, match="still busy"):
        transport.send(FORWARD)
    transport.send(FORWARD)


def test_a_service_after_close_does_nothing():
    bus = BrokenBus(())
    transport = RoboMasterCan(bus)
    with transport:
        pass
    tried = bus.tried
    transport.service(0.0)
    assert bus.tried == tried


def test_a_given_bus_serves_for_one_opening():
    transport = RoboMasterCan(BrokenBus(()))
    with transport:
        pass
    with pytest.raises(MtmError, match="make a new transport"):
        transport.open()


def test_a_bus_that_cannot_be_opened_is_one_sentence():
    with pytest.raises(MtmError, match="check the interface and the channel"):
        RoboMasterCan(interface="there-is-no-such-interface", channel="0").open()


@pytest.mark.parametrize("arguments", [{}, {"bus": BrokenBus(()), "channel": "can0"}])
def test_a_link_needs_either_a_bus_or_its_options(arguments):
    with pytest.raises(MtmError, match="one of the two"):
        RoboMasterCan(**arguments)


def test_two_threads_never_mix_their_frames(monkeypatch):
    monkeypatch.setattr("mtm_onboard.links.robomaster_presence.LOST_S", math.inf)  # the robot stands still in time
    with can_rig() as rig, rig.transport:
        rig.transport.write_bound_s = 10.0  # a beating thread that never pauses leaves the lock to chance
        beating = threading.Thread(target=lambda: [rig.transport.service(0.01 * beat) for beat in range(300)])
        beating.start()
        for _ in range(300):
            rig.transport.send(FORWARD)
        beating.join()
        beats = rig.transport.heartbeats
        parser = Parser()
        messages = parser.feed(b"".join(bytes(frame.data) for frame in rig.sent()))
        kinds = Counter((message.cmdset, message.cmdid) for message in messages)
        assert (kinds[0x3F, 0x21], kinds[0x3F, 0x60]) == (1 + 300, beats)
        assert beats >= 300
        assert parser.dropped_bytes == 0


@pytest.mark.parametrize(("code", "refusals"), [(b"\x00", 0), (b"\x01", 1), (b"", 1)])
def test_an_answer_with_an_error_code_is_counted(code, refusals):
    with can_rig() as rig, rig.transport:
        answer = WORK_MODE.message(3, b"\x01").answer(code)
        for frame in frames(answer):
            rig.tap.send(frame)
        rig.transport.service(0.0)
        assert rig.transport.refusals == refusals


def test_a_robot_that_hears_nothing_is_stopped_by_its_deadman():
    with can_rig(deadman_s=0.2) as rig, rig.transport:
        rig.transport.send(FORWARD)
        rig.run(0.1)
        assert rig.plant.velocity_body == FORWARD
        rig.run(0.2)
        assert rig.plant.velocity_body == STOP
