import numpy as np
import pytest

from mtm_audit.detectors.matched import candidates
from mtm_audit.detectors.matched import first_pass as module
from mtm_audit.detectors.matched.estimate import fit_recording_noise
from mtm_audit.detectors.matched.first_pass import KEPT, first_pass
from mtm_audit.detectors.matched.plants import COARSE
from mtm_audit.detectors.matched.profile import log_prior
from tests.audit.detectors.matched.fleet_motion import fleet_run, motions_of, windows_of

ALPHABET = 600


def looked_at(monkeypatch, seed, whole):
    """The first pass of a robot's first window, of an alphabet that counts as large above `whole` symbols."""
    for place in (candidates, module):
        monkeypatch.setattr(place, "WHOLE", whole)
    run = fleet_run(seed, alphabet=ALPHABET)
    motions = motions_of(run)
    noise = fit_recording_noise(motions, [motion.velocities for motion in motions])
    windows = windows_of(run, motions)
    return run, first_pass([windows[seed % 4]], motions, noise, log_prior(None, COARSE))


@pytest.mark.parametrize("seed", range(4))
def test_a_large_alphabet_keeps_the_same_candidates(monkeypatch, seed):
    _, all_weighed = looked_at(monkeypatch, seed, ALPHABET)
    run, few_weighed = looked_at(monkeypatch, seed, 64)
    assert few_weighed.kept.tolist() == all_weighed.kept.tolist()
    assert few_weighed.kept[0] == run.symbols[seed % 4]
    kept = all_weighed.kept
    # Products of tones are in single precision, whichever candidates they are of.
    assert few_weighed.ratios[0][kept] == pytest.approx(all_weighed.ratios[0][kept], abs=1e-5)


def test_a_rough_look_is_near_the_exact_one(monkeypatch):
    _, all_weighed = looked_at(monkeypatch, 1, ALPHABET)
    monkeypatch.setattr(module, "_TRIED", 2 * KEPT)
    _, few_weighed = looked_at(monkeypatch, 1, 64)
    left_out = few_weighed.ratios[0] != all_weighed.ratios[0]
    assert left_out.sum() > ALPHABET // 4
    off = few_weighed.ratios[0][left_out] - all_weighed.ratios[0][left_out]
    assert np.abs(off).max() < 0.05 * np.ptp(all_weighed.ratios[0])


def test_where_doubt_is_left_more_are_weighed(monkeypatch):
    """With a rough look that errs everywhere nothing can be left out."""
    exact = module._Looked.exactly
    asked = []

    def counted(self, symbols):
        asked.append(len(symbols))
        return exact(self, symbols)

    rough = np.random.default_rng(0).normal(0.0, 100.0, ALPHABET)
    _, all_weighed = looked_at(monkeypatch, 2, ALPHABET)
    monkeypatch.setattr(module._Looked, "exactly", counted)
    monkeypatch.setattr(module._Looked, "roughly", lambda self: rough.copy())
    _, few_weighed = looked_at(monkeypatch, 2, 64)
    assert sum(asked) == ALPHABET
    assert few_weighed.kept.tolist() == all_weighed.kept.tolist()
