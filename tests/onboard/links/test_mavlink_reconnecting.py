"""A MAVLink link that is lost and comes back, with a pilot who may have acted in the meantime.

The wrapper is served by the test itself, between commands, as its own thread would: opening takes simulated time.
"""

import pytest

from mtm_onboard.links.base import TakenOverError
from mtm_onboard.links.mavlink import MavlinkLink
from mtm_onboard.links.reconnecting import ReconnectingLink
from mtm_onboard.model.velocity import STOP, BodyVelocity
from mtm_onboard.protocol import MtmError
from tests.onboard.links.mavlink_rig import mavlink_rig

FORWARD = BodyVelocity(0.5, 0.0, 0.0)


class Link:
    """A reconnecting link over the rig's wire that may set the mode and arm."""

    def __init__(self, rig, profile):
        self.rig = rig

        def make():
            return MavlinkLink(
                profile=profile, set_mode=True, arm=True, open_timeout_s=2.0, clock=rig.clock,
                open_port=lambda: rig.wire,
            )  # fmt: skip

        self.transport = ReconnectingLink(make, rig.clock)

    def drive(self, seconds):
        end_s = self.rig.clock.now() + seconds
        while self.rig.clock.now() < end_s - 1e-9:
            self.transport.send(FORWARD)
            for _ in range(2):
                self.transport.service(self.rig.clock.now())
                self.rig.run(0.01)

    @property
    def is_up(self):
        return self.transport.up_since_s is not None


@pytest.fixture(params=["rover", "copter"])
def link(request):
    return Link(mavlink_rig(request.param, vehicle={"is_guided": False, "is_armed": False}), request.param)


def test_a_lost_vehicle_is_driven_again_once_it_is_heard_again(link):
    rig = link.rig
    with link.transport:
        link.drive(1.0)
        assert rig.plant.velocity_body == FORWARD
        rig.vehicle._port.is_cut = True
        link.drive(5.0)
        assert not link.is_up
        assert rig.plant.velocity_body == STOP  # its own time-out
        rig.vehicle._port.is_cut = False
        link.drive(12.0)
        assert link.is_up
        assert rig.plant.velocity_body == FORWARD
        assert link.transport.losses == 1


@pytest.mark.parametrize("way", ["switches", "disarms"])
def test_what_a_pilot_did_during_an_outage_is_never_undone(link, way):
    rig, vehicle = link.rig, link.rig.vehicle
    with link.transport:
        link.drive(1.0)
        vehicle._port.is_cut = True
        link.drive(5.0)
        asked = list(vehicle.requests)
        if way == "switches":
            vehicle.pilot_switches(vehicle.firmware.other_mode)
        else:
            vehicle.pilot_disarms()
        vehicle._port.is_cut = False
        link.drive(15.0)
        assert not link.is_up
        assert vehicle.requests == asked
        assert not vehicle.is_obeying
        vehicle.is_armed = True
        vehicle.pilot_switches(vehicle.firmware.guided_mode)
        link.drive(15.0)
        assert link.is_up
        assert rig.plant.velocity_body == FORWARD
        assert vehicle.requests == asked


def test_a_takeover_is_no_lost_link_and_ends_the_run(link):
    vehicle = link.rig.vehicle
    with link.transport:
        link.drive(1.0)
        asked = list(vehicle.requests)
        vehicle.pilot_switches(vehicle.firmware.other_mode)
        with pytest.raises(TakenOverError):
            link.drive(2.0)
    link.rig.run(5.0)
    assert vehicle.requests == asked
    assert link.transport.losses == 0
    assert not vehicle.is_obeying


def test_a_sideways_command_to_a_rover_is_no_lost_link():
    link = Link(mavlink_rig("rover"), "rover")
    with link.transport:
        with pytest.raises(ValueError, match="cannot move sideways"):
            link.transport.send(BodyVelocity(0.0, 0.1, 0.0))
        assert link.is_up
        assert link.transport.losses == 0


def test_a_first_opening_that_fails_is_not_tried_again():
    link = Link(mavlink_rig("copter", vehicle={"can_arm": False, "is_armed": False}), "copter")
    with pytest.raises(MtmError, match="not armed"):
        link.transport.open()
