"""What a window says of each tone, against the plain sums over its cells."""

from dataclasses import replace

import numpy as np
import pytest

from mtm_audit.detectors.matched.correlate import Prepared
from mtm_audit.detectors.matched.motion import Motion
from mtm_audit.detectors.matched.plants import TAIL_S, plant_family, tone_responses
from mtm_audit.detectors.matched.projections import Places, project

STEP_S, COUNT, LENGTH_S = 0.04, 300, 2.0
PLANTS = plant_family(np.array([0.0, 0.1]), np.array([0.05, 0.2]))
TONES_HZ = np.arange(1, 11) / LENGTH_S


def prepared(seed=0, axes=2):
    rng = np.random.default_rng(seed)
    weights = rng.uniform(0.0, 1.4, (axes, COUNT))
    motion = Motion(10.0, STEP_S, rng.standard_normal((axes, COUNT)), np.ones(COUNT, dtype=bool))
    filters = np.tile([1.0, -0.7, 0.3], (axes, 1))
    return Prepared(motion, rng.standard_normal((axes, COUNT)), weights, np.ones(axes), filters)


def places(*starts_s, groups=None):
    groups = np.arange(len(starts_s)) if groups is None else np.array(groups)
    return Places(np.array([starts_s]), groups, PLANTS, LENGTH_S, TONES_HZ)


def direct(ready, start_s, tones):
    """Each axis correlated with what each plant makes of complex `tones` (K,), (plants, axes)."""
    since_s = ready.motion.middles_s - start_s
    inside = (since_s >= 0.0) & (since_s <= LENGTH_S + TAIL_S)
    heard = tone_responses(PLANTS, TONES_HZ, since_s[inside], LENGTH_S)
    waveforms = np.einsum("k,pkn->pn", tones, heard).real
    return waveforms @ ready.filtered[:, inside].T


@pytest.mark.parametrize("start_s", [11.2, 14.0, 18.4])
def test_tones_times_projections_are_the_correlation(start_s):
    ready, rng = prepared(), np.random.default_rng(1)
    tones = rng.standard_normal(10) + 1j * rng.standard_normal(10)
    found = project(ready, places(start_s)).linear[0, :, 0]
    assert found @ np.concatenate([tones.real, -tones.imag]) == pytest.approx(direct(ready, start_s, tones))


def test_starts_between_cells_turn_the_phase():
    """A tenth of a cell later is a tenth of a cell's turn, but for the ends, where a response sets in."""
    ready, tones = prepared(), np.exp(1j * np.arange(10.0))
    start_s = 14.0 + 0.4 * STEP_S
    found = project(ready, places(start_s)).linear[0, :, 0] @ np.concatenate([tones.real, -tones.imag])
    expected = direct(ready, start_s, tones)
    assert np.corrcoef(found.ravel(), expected.ravel())[0, 1] > 0.99


def test_windows_of_one_group_add_up():
    ready = prepared()
    apart, together = project(ready, places(11.2, 15.2)), project(ready, places(11.2, 15.2, groups=[0, 0]))
    assert together.linear[:, :, 0] == pytest.approx(apart.linear.sum(axis=2))
    assert together.seen[:, 0] == pytest.approx(apart.seen.sum(axis=1))


def test_a_whole_window_s_cells_count_as_they_weigh():
    ready = prepared()
    found = project(ready, places(14.0))
    cells = int(np.ceil((LENGTH_S + TAIL_S) / STEP_S))
    weights = ready.weights[:, 100 : 100 + cells].mean(axis=1)
    assert found.cells == LENGTH_S / STEP_S
    assert found.seen[0, 0] == pytest.approx(weights * found.cells)


def test_a_quiet_axis_counts_as_much_more_as_it_is_quieter():
    """In units of one interference for all axes, with as much precision in all as the axes have."""
    ready = prepared()
    alike, unlike = project(ready, places(14.0)), project(replace(ready, scales=np.array([0.1, 0.2])), places(14.0))
    share = np.array([2.0, 1.0]) / np.sqrt(2.5)
    assert unlike.linear == pytest.approx(alike.linear * share[:, None])
    assert unlike.power == pytest.approx(alike.power * share[:, None] ** 2)


def test_a_plant_that_damps_a_tone_gives_it_less_power():
    power = project(prepared(), places(14.0)).power[:, 0]
    quick, slow = 0, 1
    assert np.all(power[slow] < power[quick])
    assert (power[slow] / power[quick])[-1] < (power[slow] / power[quick])[0]
