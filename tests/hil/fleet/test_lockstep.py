import numpy as np
import pytest

from hil.fleet.lockstep import run_lockstep
from hil.fleet.rig import RunSettings, seeds_of
from mtm_onboard.cli import main as onboard
from mtm_onboard.protocol import Channel, Key, MtmError, Scheme
from mtm_onboard.runtime.modulator import Modulator
from tests.hil.fleet.short_runs import FAKE_SECRET, fake_key, short_run


def motion(result):
    return np.stack([np.column_stack([one.positions_xy_m, one.headings_rad]) for one in result.trajectories])


def test_the_can_bus_and_no_wire_give_the_same_motion():
    over_can, direct = run_lockstep(short_run(wire="can")), run_lockstep(short_run(wire="direct"))
    assert np.array_equal(motion(over_can), motion(direct))
    assert np.ptp(motion(direct)[:, :, 0], axis=1).min() > 0.3


def test_in_plaintext_the_motion_is_the_same_up_to_rounding():
    direct, plaintext = (motion(run_lockstep(short_run(wire=wire))) for wire in ("direct", "plaintext"))
    difference = np.abs(plaintext - direct)
    assert 0.0 < difference[:, :, :2].max() < 5e-4
    assert difference[:, :, 2].max() < 1e-3


def test_over_mavlink_the_motion_is_the_same_but_for_a_tick():
    direct, vehicle = (run_lockstep(short_run(wire=wire)) for wire in ("direct", "mavlink"))
    assert all(robot.is_clean for robot in vehicle.robots), vehicle.robots
    assert {(robot.sent, robot.missed) for robot in vehicle.robots} == {(149, 0)}
    # A tick at 0.5 m/s is a centimetre.
    assert 0.0 < np.abs(motion(vehicle) - motion(direct))[:, :, :2].max() < 0.011


@pytest.mark.parametrize("wire", ["can", "plaintext", "direct"])
def test_a_run_ends_with_every_robot_stopped_and_nothing_wrong(wire):
    result = run_lockstep(short_run(wire=wire))
    assert all(robot.is_clean for robot in result.robots), result.robots
    assert {(robot.sent, robot.missed) for robot in result.robots} == {(150, 0)}
    assert [robot.name for robot in result.robots] == ["robot0", "robot1", "robot2", "robot3"]


def test_the_motion_is_sampled_at_100_hz_from_start_to_end():
    (first, *_) = run_lockstep(short_run()).trajectories
    assert first.times_s == pytest.approx(np.arange(301) / 100)


def test_the_same_seed_repeats_the_run_and_another_does_not():
    one, again, other = (motion(run_lockstep(short_run(seed=seed))) for seed in (1, 1, 2))
    assert np.array_equal(one, again)
    assert not np.array_equal(one, other)


def test_nothing_differs_before_the_message_and_all_after():
    silent, sending = motion(run_lockstep(short_run(symbols=None))), motion(run_lockstep(short_run()))
    differs = np.any(silent != sending, axis=(0, 2))
    # Tick 0 is at 0.5 s; the poll after it hands it to the plant, whose delay is 60 ms.
    assert not differs[:57].any()
    assert differs[58:].all()


def test_another_secret_moves_the_robots_otherwise():
    other = Key("other", b"another secret that is not real!", fake_key().scheme)
    assert not np.array_equal(motion(run_lockstep(short_run())), motion(run_lockstep(short_run(key=other))))


def test_something_else_may_take_the_modulator_s_place():
    made = []

    def factory(codebook, channel_name, symbols):
        made.append((channel_name, symbols))
        return Modulator(codebook, channel_name, symbols)

    assert np.array_equal(motion(run_lockstep(short_run(modulator=factory))), motion(run_lockstep(short_run())))
    assert made == [("robot0", (0,)), ("robot1", (1,)), ("robot2", (2,)), ("robot3", (3,))]


def test_slip_permutation_and_sensors_have_seeds_of_their_own():
    assert len(set(seeds_of(3).slips)) == 4
    assert len({seeds_of(seed).permutation() for seed in range(40)}) > 10


def test_the_fleet_s_scheme_is_the_key_generator_s_preset(tmp_path, capsys):
    onboard(["keygen", "--id", "a", "--preset", "paper-robomaster-fleet", "--out", str(tmp_path / "a.key")])
    assert fake_key(600).scheme.fingerprint in capsys.readouterr().out


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"seconds": 0.4}, "make it last longer"),
        ({"seconds": float("nan")}, "make it last longer"),
        ({"symbols": (0, 1)}, "2 symbols given"),
        ({"symbols": (0, 1, 2, 4)}, "outside the alphabet"),
        ({"seed": -1}, "seed is -1"),
        ({"robots": 3}, "moves 4 bodies; give --robots 4 or more"),
        ({"robots": 13}, "13 robots do not fit into the arena; it holds 12"),
    ],
)
def test_settings_that_make_no_sense_are_refused_in_one_sentence(changes, sentence):
    with pytest.raises(MtmError, match=sentence):
        short_run(**changes)


def test_a_channel_of_no_body_velocity_is_refused_at_rest():
    joints = tuple(Channel(f"j{number}", f"j{number}", ("elbow",), 1, 0.1) for number in range(4))
    key = Key(
        "arms",
        FAKE_SECRET,
        Scheme(name="arms", rate_hz=50.0, band_hz=(0.5, 5.0), alphabet_size=4, message_ticks=100, channels=joints),
    )
    with pytest.raises(MtmError, match="elbow"):
        run_lockstep(RunSettings(key=key, symbols=(0, 1, 2, 3), seconds=2.0, seed=1, start_s=0.5))
