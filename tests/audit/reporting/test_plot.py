"""What stands on the pictures that `--plot` draws, beside their panels."""

from dataclasses import replace
from datetime import UTC, datetime, timedelta, timezone
from pathlib import Path

import numpy as np
import pytest

from mtm_audit.model.recorded_at import RecordedAt
from mtm_audit.reporting.journal_plot import draw_journal
from mtm_audit.reporting.plot import draw_plot
from mtm_audit.reporting.subject import dated, files_named, subject_line
from mtm_onboard.protocol.journal_file import JournalHeader, JournalRecord
from tests.audit.reporting.pictured import both_sent, one_unseen, under_another_key

DRAWN = datetime(2026, 1, 31, 12, 0, tzinfo=timezone(timedelta(hours=1)))
HEADER = JournalHeader(
    fingerprint="0123", key_id="fake", robot="robot0", channel="robot0", symbols=(1,), repeat=True, rate_hz=50.0,
    start_s=0.0, start_unix_s=1_700_000_000.0,
)  # fmt: skip


@pytest.fixture
def drawn(monkeypatch):
    """The figures that are drawn, in the place of files."""
    figures = []
    for module in ("plot", "journal_plot"):
        monkeypatch.setattr(f"mtm_audit.reporting.{module}.save_figure", lambda figure, *_: figures.append(figure))
    return figures


def words(figure):
    return " ".join(text.get_text() for text in figure.texts)


def titles(figure):
    return [axes.get_title() for axes in figure.axes if axes.get_title()]


@pytest.mark.parametrize("made", [both_sent, one_unseen, under_another_key])
def test_a_picture_names_recording_key_and_date(drawn, made, tmp_path):
    draw_plot(*made(), tmp_path / "decode.png")
    assert "recording motion.tum · key fake (scheme test, " in words(drawn[0])
    assert f"drawn {datetime.now(UTC).astimezone():%Y-%m-%d}" in words(drawn[0])


def test_a_picture_without_a_message_has_no_symbols(drawn, tmp_path):
    draw_plot(*under_another_key(), tmp_path / "decode.png")
    assert titles(drawn[0]) == ["Where the robots went (● start, □ end)", "Evidence for any message of this key"]


def test_a_journal_s_picture_names_journal_key_and_dates(drawn, tmp_path):
    nothing = np.zeros((2, 3))
    record = JournalRecord(
        header=HEADER, ticks=np.arange(2), times_s=np.arange(2) / 50.0, base=nothing, sent=nothing,
        lateness_s=np.ones(2), flags=np.zeros(2, int), damaged=0,
    )  # fmt: skip
    draw_journal(record, Path("runs/robot0.csv"), tmp_path / "run.png")
    assert "journal robot0.csv · key fake (scheme 0123) · started 2023-11-14 22:13:20 UTC" in words(drawn[0])
    assert "drawn 20" in words(drawn[0])


def test_the_date_of_a_recording_is_that_of_its_first_picture():
    recording, decoding = both_sent()
    late = tuple(replace(track, times_s=track.times_s + 60.0) for track in recording.tracks)
    begun = RecordedAt(datetime(2026, 1, 31, tzinfo=UTC).timestamp())
    line = subject_line(replace(recording, tracks=late, at=begun), decoding, DRAWN)
    assert "recorded 2026-01-31 00:01:00 UTC" in line
    assert "recorded at an unknown time" in subject_line(recording, decoding, DRAWN)


def test_dates_have_a_zone_and_several_files_their_folder():
    assert dated(DRAWN) == "2026-01-31 12:00:00 +01:00"
    assert files_named([Path("a/mocap/x.tum"), Path("a/mocap/y.tum")]) == "mocap/ (2 files)"
    assert files_named([Path("a/film.mp4")]) == "film.mp4"
