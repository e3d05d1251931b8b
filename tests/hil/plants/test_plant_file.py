import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from hil.plants.family import CREATE_FILE
from hil.plants.linear_response import LinearResponse
from hil.plants.plant_file import IdentifiedAxis, IdentifiedPlant, IdentifiedRobot, load_plant, save_plant
from hil.plants.robots import STEP_S
from mtm_onboard.protocol import MtmError

AHEAD = IdentifiedAxis(LinearResponse(gain=0.5, delay_s=0.1, lag_s=0.2), 0.02, 0.1)
TURN = IdentifiedAxis(LinearResponse(gain=0.9, delay_s=0.05, natural_hz=2.0, damping=0.6), 0.0, 0.1)
ROBOT = IdentifiedRobot("a log", {"vx": AHEAD, "wz": TURN})
PLANT = IdentifiedPlant('a "rover"', "made up", (ROBOT,))


def test_a_plant_survives_its_file(tmp_path):
    save_plant(PLANT, tmp_path / "a.toml", ["a comment"])
    assert load_plant(tmp_path / "a.toml") == PLANT
    assert (tmp_path / "a.toml").read_text().startswith("# a comment\nformat = 1\n")


def numbers(low, high):
    return st.floats(low, high).map(lambda value: float(f"{value:.4g}"))


@given(
    gain=numbers(1e-3, 50.0), delay_s=numbers(0.0, 5.0), lag_s=numbers(0.0, 50.0), natural_hz=numbers(0.1, 40.0),
    deviation=numbers(0.0, 10.0), summary=st.text(st.characters(exclude_categories=["Cs"]), max_size=20),
)  # fmt: skip
def test_any_plant_survives_its_file(tmp_path_factory, gain, delay_s, lag_s, natural_hz, deviation, summary):
    response = LinearResponse(gain=gain, delay_s=delay_s, lag_s=lag_s, natural_hz=natural_hz, damping=0.5)
    plant = IdentifiedPlant(summary, "", (IdentifiedRobot("", {"vy": IdentifiedAxis(response, deviation, 1.0)}),))
    path = tmp_path_factory.mktemp("plants") / "a.toml"
    save_plant(plant, path)
    assert load_plant(path) == plant


def test_the_robot_follows_on_its_own_axes_alone():
    robot = ROBOT.robot()
    followed = robot.respond(STEP_S).advance(np.ones((2000, 3)))
    assert followed[-1] == pytest.approx([0.5, 0.0, 0.9], abs=1e-3)
    assert np.all(followed[:9, 0] == 0.0)
    noise = robot.disturb(STEP_S, np.random.default_rng(1)).advance(20_000)
    assert noise.std(axis=0) == pytest.approx([0.02, 0.0, 0.0], rel=0.1)


def test_one_of_the_robots_is_drawn():
    other = IdentifiedRobot("another", {"vx": TURN, "wz": AHEAD})
    plant = IdentifiedPlant("", "", (ROBOT, other))
    ends = {
        float(np.round(plant.draw(np.random.default_rng(seed)).respond(STEP_S).advance(np.ones((2000, 3)))[-1, 0], 2))
        for seed in range(8)
    }
    assert ends == {0.5, 0.9}


def test_the_identified_robots_are_ten_and_name_their_source():
    plant = load_plant(CREATE_FILE)
    assert len(plant.robots) == 10
    assert plant.axes == ("vx", "wz")
    assert "MR.CLAM data sets 6 and 7" in plant.source
    delays_s = [robot.axes["vx"].response.delay_s for robot in plant.robots]
    assert 0.05 < min(delays_s) < max(delays_s) < 0.35


WHOLE = "format = 1\n[[robots]]\n[robots.vx]\ngain = 1\ndelay_s = 0.1\ndeviation = 0.1\ncorrelation_s = 0.1\n"


@pytest.mark.parametrize(
    ("text", "sentence"),
    [
        ("format = 2", "of plant format 2"),
        ("format = 1", "has no robots"),
        ("format = 1\nrobots = [1]", "has no robots"),
        ("format = 1\n[[robots]]", "robot 1 follows no axis"),
        ("format = 1\n[[robots]]\nvx = 1", "robot 1, vx is not a table"),
        (WHOLE.replace("gain = 1\n", ""), "robot 1, vx lacks gain"),
        (WHOLE.replace("gain = 1", "gain = 'a'"), "gain of robot 1, vx is 'a'"),
        (WHOLE.replace("gain = 1", "gain = true"), "gain of robot 1, vx is True"),
        (WHOLE.replace("delay_s = 0.1", "delay_s = -0.1"), "must be a number from 0 to 10"),
        (WHOLE.replace("delay_s = 0.1", "delay_s = nan"), "must be a number from 0 to 10"),
        (WHOLE + "natural_hz = 2\n", "has one of natural_hz and damping"),
        (WHOLE + "mass = 2\n", "unknown field 'mass'"),
        ("speed = 3\n" + WHOLE, "the file has an unknown field 'speed'"),
        ("summary = 3\n" + WHOLE, "summary is 3 and must be a text"),
        (WHOLE + WHOLE.partition("\n")[2].replace("vx", "wz"), "the robots differ in their axes"),
        ("format = ", "is no plant file"),
    ],
)
def test_a_broken_plant_file_gets_one_sentence(tmp_path, text, sentence):
    (tmp_path / "a.toml").write_text(text)
    with pytest.raises(MtmError, match=sentence):
        load_plant(tmp_path / "a.toml")


@given(text=st.text(max_size=200))
def test_no_text_breaks_the_reader(tmp_path_factory, text):
    path = tmp_path_factory.mktemp("plants") / "a.toml"
    path.write_bytes(text.encode("utf-8", "surrogatepass"))
    with pytest.raises(MtmError):
        load_plant(path)
