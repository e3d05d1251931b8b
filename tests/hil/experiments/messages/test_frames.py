import numpy as np
import pytest

from hil.experiments.messages.frames import (
    ATTACKS,
    CODES,
    DECODERS,
    NOISE,
    THRESHOLDS,
    frame_cells,
    read_frames,
    row_of,
)
from hil.experiments.runs.cells import Cell


def one_cell(what, code="reed-solomon", check="tag", bits=32, distance=0.0):
    parameters = {"what": what, "code": code, "check": check, "check_bits": bits, "distance": distance}
    return row_of([Cell("frames", parameters, 3)], [read_frames(parameters, 3)])


@pytest.mark.parametrize("code", CODES)
@pytest.mark.parametrize("attack", ATTACKS)
def test_no_attack_on_a_tagged_frame_is_authenticated(attack, code):
    line = one_cell(attack, code)
    assert (line.frames, line.wrong) == (100, 0)
    assert line.tries > 0 or line.right == 100
    assert (line.right == 0) == attack.startswith("another")


def test_one_changed_symbol_is_corrected_even_without_a_code():
    assert one_cell("changed symbol", "none").right == 100


def test_the_thresholds_are_where_half_of_the_frames_are_read():
    line = one_cell(NOISE, "reed-solomon", bits=16, distance=THRESHOLDS["reed-solomon", 16])
    assert 25 <= line.right <= 75
    assert line.expected_wrong == line.tries / 2**16


@pytest.mark.parametrize("foreign", ["", " among foreign symbols"])
def test_the_decoder_that_ranks_all_candidates_reads_the_most(foreign):
    read = [one_cell(decoder + foreign, bits=24, distance=2.4).right for decoder in DECODERS]
    assert read[0] <= read[1] < read[2]


def test_a_cell_gives_the_same_again():
    assert one_cell(NOISE, bits=16, distance=1.6) == one_cell(NOISE, bits=16, distance=1.6)


def test_every_check_gets_its_frames_and_no_cell_comes_twice():
    plans = frame_cells(10_000, 7)
    cells = [cell for plan in plans for cell in plan]
    assert len({cell.name for cell in cells}) == len(cells)
    noise = [plan for plan in plans if plan[0].parameters["what"] == NOISE]
    assert {len(plan) for plan in noise} == {50}
    assert len(noise) == 12
    assert np.unique([cell.seed for cell in noise[0]]).tolist() == list(range(7, 57))
