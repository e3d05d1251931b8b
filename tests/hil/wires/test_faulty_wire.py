import can
import pytest

from hil.fleet.clock import SimulatedClock
from hil.wires.faulty_wire import FaultyBus, FaultyPort, FaultyText, FaultyTextPort, FaultyWire, WireFaults
from mtm_onboard.links.base import LinkBusyError
from mtm_onboard.protocol import MtmError

UNITS = [bytes((number,)) * 4 for number in range(200)]


@pytest.fixture
def wire():
    return FaultyWire(SimulatedClock(), seed=1)


def carried(wire, units=UNITS):
    """What arrives of units sent a hundredth of a second apart."""
    arrived = []
    for unit in units:
        wire.to_robot.put(unit)
        wire.clock.sleep_until(wire.clock.now() + 0.01)
        while (got := wire.to_robot.take()) is not None:
            arrived.append(got)
    return arrived


def test_a_sound_wire_carries_everything_as_it_is(wire):
    assert carried(wire) == UNITS


def test_a_wire_that_drops_loses_about_that_part(wire):
    wire.faults = WireFaults(drop=0.25)
    arrived = carried(wire)
    assert 120 < len(arrived) < 180
    assert arrived == [unit for unit in UNITS if unit in arrived]


def test_a_wire_that_duplicates_sends_about_that_part_twice(wire):
    wire.faults = WireFaults(duplicate=0.25)
    arrived = carried(wire)
    assert 220 < len(arrived) < 280
    assert list(dict.fromkeys(arrived)) == UNITS


def test_a_wire_that_corrupts_changes_bytes_and_no_lengths(wire):
    wire.faults = WireFaults(corrupt=0.25)
    arrived = carried(wire)
    changed = sum(one != other for one, other in zip(arrived, UNITS, strict=True))
    assert 20 < changed < 80
    assert {len(unit) for unit in arrived} == {4}


def test_a_wire_that_reorders_lets_the_next_one_overtake(wire):
    wire.faults = WireFaults(reorder=0.25)
    arrived = carried(wire)
    assert arrived != UNITS
    assert sorted(arrived) == UNITS[: len(arrived)] or len(arrived) == len(UNITS) - 1
    assert all(abs(place - unit[0]) <= 1 for place, unit in enumerate(arrived))


def test_a_slow_wire_keeps_the_order_and_the_least_delay(wire):
    wire.faults = WireFaults(delay_s=(0.05, 0.3))
    wire.to_robot.put(b"one")
    wire.to_robot.put(b"two")
    wire.clock.sleep_until(0.049)
    assert wire.to_robot.take() is None
    wire.clock.sleep_until(0.3)
    assert (wire.to_robot.take(), wire.to_robot.take()) == (b"one", b"two")


def test_a_wire_that_swallows_takes_everything_and_gives_nothing(wire):
    wire.swallows = True
    assert carried(wire) == []
    wire.restore()
    assert carried(wire) == UNITS


def frame(data: bytes = b"12345678") -> can.Message:
    return can.Message(arbitration_id=0x201, is_extended_id=False, data=data)


def test_a_cut_can_bus_is_off_and_loses_what_was_under_way(wire):
    ours, theirs = FaultyBus(wire, is_robot=False), FaultyBus(wire, is_robot=True)
    ours.send(frame())
    wire.cut()
    for use in (lambda: ours.send(frame()), ours.recv):
        with pytest.raises(can.CanOperationError, match="bus off"):
            use()
    assert theirs.recv() is None
    wire.restore()
    ours.send(frame(b"ab"))
    received = theirs.recv()
    assert (received.arbitration_id, bytes(received.data)) == (0x201, b"ab")
    theirs.send(frame(b"cd"))
    assert (ours.recv().arbitration_id, theirs.recv()) == (0x202, None)


def test_a_cut_line_fails_for_us_alone(wire):
    ours, theirs = FaultyText(wire), FaultyTextPort(wire)
    ours.write(b"command;chassis speed x 1;", 0.0)
    assert theirs.receive() == b"command;chassis speed x 1;"
    wire.cut()
    theirs.answer(b"ok;")
    assert theirs.receive() == b""
    for use in (lambda: ours.write(b"command;", 0.0), ours.read):
        with pytest.raises(MtmError, match="unplugged"):
            use()
    wire.restore()
    assert ours.read() == b""
    theirs.push(b"ok;")
    assert ours.read() == b"ok;"


def test_a_cut_port_fails_for_us_alone(wire):
    ours, theirs = FaultyPort(wire, is_robot=False), FaultyPort(wire, is_robot=True)
    ours.write(b"set-point")
    assert theirs.read() == b"set-point"
    theirs.write(b"heartbeat")
    ours.close()
    wire.cut()
    for use in (lambda: ours.write(b"set-point"), ours.read):
        with pytest.raises(MtmError, match="unplugged"):
            use()
    theirs.write(b"heartbeat")
    wire.restore()
    assert (ours.read(), theirs.read()) == (b"", b"")


def test_a_blocked_wire_is_busy_for_a_part_of_the_time(wire):
    wire.faults = WireFaults(block_s=0.1)
    writes = (
        lambda: FaultyBus(wire, is_robot=False).send(frame()),
        lambda: FaultyText(wire).write(b"ok;", 0.0),
        lambda: FaultyPort(wire, is_robot=False).write(b"set-point"),
    )
    for write, kind in zip(writes, (can.CanOperationError, LinkBusyError, LinkBusyError), strict=True):
        with pytest.raises(kind):
            write()
    wire.clock.sleep_until(0.25)
    for write in writes:
        write()
    assert wire.to_robot.take() is not None
