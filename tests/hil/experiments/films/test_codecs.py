import numpy as np
import pytest

from hil.commands import codecs as command
from hil.experiments.films import codecs, motion
from hil.experiments.films.codecs import film_under_all, filmed, motion_px
from hil.experiments.films.coding import CODINGS
from hil.experiments.films.motion import kept_under_all
from hil.experiments.runs.fingerprint import code_fingerprint
from tests.hil.commands.test_verdicts import run

FEW = [coding for coding in CODINGS if coding.name in ("H.264 lossless", "H.264 CRF 12", "H.264 CRF 28")]


@pytest.mark.slow
def test_coarser_films_keep_less_of_a_small_motion(monkeypatch):
    monkeypatch.setattr(motion, "CODINGS", FEW)
    kept = kept_under_all({"motion_px": 0.03}, 1)
    lossless, fine, coarse = (kept[f"{coding.name} kept"] for coding in FEW)
    assert lossless > fine > coarse + 0.3
    assert lossless > 0.8


@pytest.mark.slow
def test_a_rollout_tells_evidence_under_each_coding(monkeypatch):
    monkeypatch.setattr(codecs, "CODINGS", FEW[:1])
    monkeypatch.setattr(codecs, "_SECONDS", 13.5)
    found = film_under_all({"sigma_mps": 0.1, "pixels_per_metre": 100}, 1)
    one = filmed(found, FEW[0])
    assert one.decoded
    assert one.evidence_bits > 100
    assert found["motion capture bits"] > one.evidence_bits / 2


def test_the_commanded_motion_in_pixels_is_that_of_its_tones():
    # One tone alone would move a robot by sigma / (2 pi f); the band's lowest tones move it most.
    assert 0.1 * 100 / (2 * np.pi * 5.0) < motion_px(0.1, 100) < 0.1 * 100 / (2 * np.pi * 0.5)
    assert motion_px(0.2, 50) == pytest.approx(motion_px(0.1, 100))


def test_both_tables_have_a_row_for_each_coding(tmp_path, capsys, monkeypatch):
    fields = {f"{coding.name} {field}": 0.5 for coding in CODINGS
              for field in ("bits", "decoded", "bits a pixel", "kbit/s", "kept", "gain")}  # fmt: skip
    monkeypatch.setattr(command, "film_under_all", lambda *_: {**fields, "motion capture bits": 2.0})
    monkeypatch.setattr(command, "kept_under_all", lambda *_: fields)
    for arm, kinds in (("evidence", 4), ("motion", 3)):
        out = tmp_path / f"{arm}.csv"
        asked = ["codecs", arm, "-n", 1, "--workers", 1, "--out", out, "--cells", tmp_path / f"{arm}.jsonl"]
        assert run(*asked) == 0
        first, second, *rows = out.read_text().splitlines()
        assert first == f"# mtm-hil codecs {arm} -n 1 --seed 900000 --out {out}"
        assert second == f"# code {code_fingerprint()}"
        assert sum(not row.startswith(("#", "sigma", "motion")) for row in rows) == kinds * len(CODINGS)
