from dataclasses import asdict

import pytest

from hil.experiments.plants.rollout import PlantJob, plant_cells, read_plant
from mtm_onboard.protocol import MtmError

LOUD = PlantJob(alphabet_size=4, ticks=150, windows=2, sigma=0.25)


@pytest.mark.parametrize("plant", ["diff-drive", "arm", "legged"])
def test_the_genie_reads_every_symbol_of_a_loud_robot(plant):
    result = read_plant({"plant": plant, **asdict(LOUD)}, 3)
    assert result["genie"] == 2
    assert 0 <= result["coherency"] <= 2
    assert result["verdict"] in {"decoded", "inconclusive", "absent"}
    assert result["wrong"] is False


def test_the_calibrated_robot_is_decoded_and_repeats_itself():
    parameters = {"plant": "robomaster", **asdict(LOUD)}
    result = read_plant(parameters, 5)
    assert (result["matched"], result["verdict"]) == (2, "decoded")
    assert result["bits"] > 15.0
    assert result == read_plant(parameters, 5)


def test_a_silent_robot_gives_the_genie_nothing():
    results = [read_plant({"plant": "notch", **asdict(PlantJob(16, 100, 4, 1e-5))}, seed) for seed in range(3)]
    assert sum(result["genie"] for result in results) <= 5
    assert {result["verdict"] for result in results} == {"absent"}


def test_there_is_a_cell_for_each_rollout():
    assert [cell.seed for cell in plant_cells("arm", PlantJob(), 2, 5)] == [5, 6]


def test_a_plant_that_is_not_known_gets_one_sentence():
    with pytest.raises(MtmError, match=r"there is no plant 'boat'; choose from: robomaster, diff-drive"):
        read_plant({"plant": "boat", **asdict(PlantJob())}, 1)


@pytest.mark.parametrize("plant", ["notch", "tanh"])
def test_plants_that_the_search_does_not_know_are_read(plant):
    # The genie, which knows each of them, has about 31 of the 36; windows laid late lost half of these.
    results = [read_plant({"plant": plant, **asdict(PlantJob())}, seed) for seed in range(40, 49)]
    assert sum(result["matched"] for result in results) >= 24
