import io
import math
from dataclasses import replace

import pytest
from rich.console import Console

from hil.experiments.detectors.calibrate import Candidate, best_candidate, scan, write_plant
from hil.experiments.detectors.paper_figures import MARGINS
from hil.experiments.runs.cells import CellStore
from hil.plants.mecanum import calibrated_parameters

QUIET = Console(file=io.StringIO())
PERFECT = Candidate(0.05, MARGINS, dict.fromkeys(MARGINS, 1.0))


def test_a_candidate_with_the_paper_s_own_margins_fits_perfectly():
    assert PERFECT.misfit == 0.0
    doubled = replace(PERFECT, margins={ticks: 2 * margin for ticks, margin in MARGINS.items()})
    assert doubled.misfit == pytest.approx(6 * math.log(2) ** 2)
    assert replace(PERFECT, margins={200: -0.01}).misfit == math.inf
    assert best_candidate([doubled, PERFECT]) is PERFECT


def test_more_slip_gives_smaller_margins(tmp_path):
    with CellStore(tmp_path / "cells.jsonl") as store:
        calm, wild = scan(calibrated_parameters(), (0.01, 0.1), 2, store, QUIET, message_ticks=(200,), workers=1)
    assert calm.margins[200] > wild.margins[200] + 0.05
    assert calm.accuracies[200] >= wild.accuracies[200]


def test_the_plant_s_file_says_how_it_was_made_and_reads_back(tmp_path):
    plant = calibrated_parameters()
    write_plant(tmp_path / "plant.toml", plant, replace(PERFECT, slip_mps=0.0425), "mtm-hil calibrate -n 20")
    text = (tmp_path / "plant.toml").read_text()
    assert text.startswith("# mtm-hil calibrate -n 20\n")
    assert "# T =  200: margin 0.102, paper 0.102, ratio 1.00, symbols 100.0 %\n" in text
    assert calibrated_parameters(tmp_path / "plant.toml") == replace(plant, slip_mps=0.0425)
