"""A CAN link notices that nobody obeys: an empty bus, a robot that refuses or falls silent, an adapter that rejects."""

import itertools

import can
import pytest

from hil.fleet.clock import SimulatedClock
from hil.vehicles.can_node import CanMotionController
from hil.vehicles.motion_controller import MotionController
from hil.wires.can_line import can_line
from hil.wires.slcan_port import SlcanPort
from mtm_onboard.links.duml import encode, segment
from mtm_onboard.links.reconnecting import ReconnectingLink
from mtm_onboard.links.robomaster_can import SUBSCRIPTION, RoboMasterCan
from mtm_onboard.links.robomaster_messages import WORK_MODE
from mtm_onboard.links.robomaster_telemetry import (
    POSITION,
    SUBSCRIBE,
    UNSUBSCRIBE,
    Subscription,
    subscription_payload,
    unsubscription_payload,
)
from mtm_onboard.model.velocity import STOP, BodyVelocity
from mtm_onboard.protocol import MtmError
from tests.hil.vehicles.floating_plant import FloatingPlant
from tests.onboard.driven import Driven

FORWARD = BodyVelocity(0.5, 0.0, 0.0)


class Wired:
    """A link and a robot on a simulated clock; the robot can be switched off, and others may talk on the bus."""

    def __init__(self, **options) -> None:
        self.clock = SimulatedClock()
        self._ours, self._theirs = can_line()
        self.is_on = True
        self.plant = FloatingPlant()
        self.node = CanMotionController(MotionController(self.plant, deadman_s=0.2), self._theirs, **options)
        self.clock.every(0.01, self._poll)
        self.link = self.make()
        self.serve(self.link)

    def make(self) -> RoboMasterCan:
        return RoboMasterCan(self._Shared(self._ours), clock=self.clock)

    def serve(self, link) -> None:
        self.clock.every(0.01, link.service)

    def run(self, seconds: float) -> None:
        self.clock.sleep_until(self.clock.now() + seconds)

    def drive(self, seconds: float) -> None:
        end_s = self.clock.now() + seconds
        while self.clock.now() < end_s - 1e-9:
            self.link.send(FORWARD)
            self.run(0.02)

    def overhear(self, message) -> None:
        """Another client of the robot sends `message`."""
        for data in segment(encode(message)):
            self._ours.send(can.Message(arbitration_id=0x201, is_extended_id=False, data=data))

    def _poll(self, now_s: float) -> None:
        if self.is_on:
            self.node.poll(now_s)
        else:
            while self._theirs.recv() is not None:
                pass

    class _Shared:
        """One end that outlives the links which use it one after the other."""

        def __init__(self, end) -> None:
            self.send, self.recv = end.send, end.recv

        def shutdown(self) -> None:
            pass


def test_an_empty_bus_is_no_robot():
    wired = Wired()
    wired.is_on = False
    with pytest.raises(MtmError, match="Nothing has come from the robot for 1.0 s; check that it is on"):
        wired.link.open()
    assert wired.clock.now() == pytest.approx(1.0, abs=0.02)


def test_an_empty_virtual_bus_is_no_robot():
    link = RoboMasterCan(interface="virtual", channel="nobody-is-there", clock=SimulatedClock())
    with pytest.raises(MtmError, match="Nothing has come"):
        link.open()


def test_a_robot_that_refuses_its_work_mode_is_not_driven():
    wired = Wired(can_engage=False)
    with pytest.raises(MtmError, match=r"refused its work mode \(0x01\)"):
        wired.link.open()
    assert wired.link.counters()["refusals"] == 1
    assert wired.link.health()["work_mode"] == "refused"


def test_a_robot_heard_without_a_work_mode_is_driven_in_doubt():
    wired = Wired(acknowledges=False)
    wired.link.open()
    assert wired.link.degraded == "the robot has not acknowledged its work mode"
    assert wired.link.health()["work_mode"] == "unanswered"
    wired.drive(3.0)
    assert wired.plant.velocity_body == FORWARD


def test_an_answer_that_comes_late_ends_the_doubt():
    wired = Wired(acknowledges=False)
    wired.link.open()
    wired.node.acknowledges = True
    assert wired.link.degraded
    wired.overhear(WORK_MODE.message(0, b"\x01"))  # the number under which the link has asked first
    wired.run(0.1)
    assert wired.link.degraded == ""


def test_an_answer_to_a_request_from_before_is_none_to_this_one():
    wired = Wired()
    wired.link.open()
    wired.link.stop()
    wired.node.acknowledges = False
    wired.link.open()
    assert wired.link.health()["work_mode"] == "unanswered"


def test_a_sound_link_tells_how_old_its_telemetry_is():
    wired = Wired()
    wired.link.open()
    for _ in range(100):
        wired.drive(0.1)
        assert wired.link.degraded == ""
    health = wired.link.health()
    assert health["work_mode"] == "acknowledged"
    assert 0.0 <= health["telemetry_age_s"] <= 0.03
    assert (health["missed_heartbeats"], health["bus_errors"], health["refusals"]) == (0, 0, 0)


def test_a_robot_switched_off_is_doubted_and_lost_in_a_second():
    wired = Wired()
    wired.link.open()
    wired.drive(1.0)
    wired.is_on, off_s = False, wired.clock.now()
    wired.drive(0.32)
    assert wired.link.degraded == "the robot sends no telemetry"
    with pytest.raises(MtmError, match="Nothing has come from the robot"):
        wired.drive(2.0)
    assert wired.clock.now() - off_s == pytest.approx(1.04, abs=0.05)


def test_a_robot_that_forgot_who_subscribed_is_asked_again():
    wired = Wired()
    wired.link.open()
    wired.overhear(UNSUBSCRIBE.message(7, unsubscription_payload(SUBSCRIPTION.stream)))
    wired.drive(5.0)
    assert wired.link.degraded == ""
    assert wired.link.health()["telemetry_age_s"] <= 0.03


def test_a_robot_that_comes_back_drives_on():
    wired = Wired()
    link = ReconnectingLink(wired.make, wired.clock)
    wired.serve(link)
    with link:
        driven = Driven(link, wired.clock)
        driven.run(1.0, FORWARD)
        wired.is_on = False
        driven.run(4.0, FORWARD)
        assert (link.losses, link.health()["link_state"]) == (1, "down")
        assert "Nothing has come from the robot" in link.fault
        wired.is_on = True
        driven.run(6.0, FORWARD)
        assert link.health()["link_state"] == "up"
        assert wired.plant.velocity_body == FORWARD
    wired.run(0.05)
    assert wired.plant.velocity_body == STOP


def test_another_client_s_stream_and_ours_live_side_by_side():
    wired = Wired()
    wired.link.open()
    wired.overhear(UNSUBSCRIBE.message(7, unsubscription_payload(0)))
    wired.overhear(SUBSCRIBE.message(8, subscription_payload(Subscription(0, (POSITION,), 10))))
    for _ in range(40):
        wired.drive(0.1)
        assert wired.link.degraded == ""
    assert SUBSCRIPTION.stream > 100


class Adapted:
    """A robot behind a serial CAN adapter, in simulated time."""

    def __init__(self) -> None:
        self.clock = SimulatedClock()
        self.port = SlcanPort()
        self.node = CanMotionController(MotionController(FloatingPlant()), self.port)
        self.clock.every(0.01, self.node.poll)

    def make(self) -> RoboMasterCan:
        return RoboMasterCan(interface="slcan", channel=self.port.path, sleep_after_open=0, clock=self.clock)


@pytest.fixture
def adapted():
    adapted = Adapted()
    yield adapted
    adapted.port.shutdown()


def test_an_adapter_that_rejects_every_frame_is_no_link(adapted):
    adapted.port.rejects = True
    link = adapted.make()
    with pytest.raises(MtmError, match="adapter reject"):
        link.open()
    assert link.counters()["rejected_frames"] >= 17


def test_an_adapter_that_begins_to_reject_is_a_lost_link(adapted):
    link = adapted.make()
    adapted.clock.every(0.01, link.service)
    link.open()
    adapted.clock.sleep_until(0.5)
    adapted.port.rejects = True
    adapted.clock.sleep_until(0.54)
    assert link.degraded == "the CAN adapter rejects frames"
    adapted.clock.sleep_until(1.0)
    with pytest.raises(MtmError, match="rejects every frame"):
        link.send(FORWARD)
    assert link.health()["rejected_frames"] >= 50
    link.close()


def test_an_adapter_that_rejects_a_frame_now_and_then_is_kept(adapted):
    link = adapted.make()
    adapted.clock.every(0.01, link.service)
    link.open()
    for burst in range(1, 40):
        adapted.port.rejects = True
        adapted.clock.sleep_until(0.1 * burst)
        adapted.port.rejects = False
        adapted.clock.sleep_until(0.1 * burst + 0.07)
        link.send(FORWARD)
    assert link.counters()["rejected_frames"] > 200
    link.stop()
    link.close()


def test_an_adapter_serves_one_program_at_a_time(adapted):
    first, second = adapted.make(), adapted.make()
    adapted.clock.every(0.01, first.service)
    first.open()
    with pytest.raises(MtmError, match=r"in use by another program; end that one"):
        second.open()
    # What the second tried has not closed the first one's channel.
    assert adapted.port.is_open
    adapted.clock.sleep_until(0.5)
    first.send(FORWARD)
    assert (first.degraded, first.counters()["rejected_frames"]) == ("", 0)
    first.stop()
    first.close()
    second.open()
    second.close()


def test_counters_of_an_adapter_outlive_its_closing(adapted):
    adapted.port.rejects = True
    link = adapted.make()
    with pytest.raises(MtmError):
        link.open()
    counted = link.counters()["rejected_frames"]
    assert counted > 0
    for _ in itertools.repeat(None, 2):
        link.close()
    assert link.counters()["rejected_frames"] == counted
