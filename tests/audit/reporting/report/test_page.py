"""The page by itself: complete, escaped, true to the verdict."""

import hashlib
import sys
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest

from mtm_audit.decoding.decoding import Decoding
from mtm_audit.model.recording import Recording
from mtm_audit.reporting.basis import FIXED, Basis
from mtm_audit.reporting.remarks import remarks
from mtm_audit.reporting.report.page import check_report_path, report_html, write_page
from mtm_audit.reporting.report.provenance import ReportRequest, provenance_of, requested
from mtm_audit.reporting.stages import stages_of_decoding, stages_of_recording
from mtm_audit.reporting.text import chance_sentence, evidence_sentence, verdict_sentence
from mtm_onboard.protocol import MtmError
from tests.audit.reporting.pictured import both_sent, decoding_of, one_unseen, track, under_another_key
from tests.audit.reporting.report.pages import Page

LATER = datetime(2099, 1, 1, tzinfo=UTC)
KINDS = {"decoded": both_sent, "absent": under_another_key, "inconclusive": one_unseen}


@pytest.fixture
def page_of(tmp_path):
    """The page of a recording, whose file and key are there to be hashed."""
    (tmp_path / "motion.tum").write_bytes(b"0 1 2 3\n")
    (tmp_path / "robot.key").write_bytes(b"a fake key file\n")

    def made(recording: Recording, decoding: Decoding, **changes):
        request = ReportRequest(
            tmp_path / "report.html", ("decode", "my film.tum"), (("key", tmp_path / "robot.key"),), LATER
        )
        shown = {
            "warnings": remarks(recording, decoding),
            "basis": Basis((FIXED,)),
            "stages": [*stages_of_recording(recording), *stages_of_decoding(decoding)],
            "tracker": "aruco",
        }
        return report_html(request, replace(recording, paths=(tmp_path / "motion.tum",)), decoding, **shown | changes)

    return made


@pytest.mark.parametrize("verdict", KINDS)
def test_a_page_is_complete_in_itself(page_of, verdict):
    recording, decoding = KINDS[verdict]()
    assert decoding.verdict == verdict
    html = page_of(recording, decoding)
    page = Page(html)
    assert (page.outside, page.handlers) == ([], [])
    assert not {"script", "iframe", "object", "embed", "base", "form"} & set(page.tags)
    assert page.tags.count("svg") == page.tags.count("figure") == (3 if verdict == "absent" else 5)
    assert "default-src 'none'" in html


@pytest.mark.parametrize("verdict", KINDS)
def test_a_page_says_what_the_terminal_says(page_of, verdict):
    recording, decoding = KINDS[verdict]()
    text = " ".join(Page(page_of(recording, decoding)).text.split())
    for sentence in (verdict_sentence(decoding), chance_sentence(decoding), evidence_sentence(decoding), FIXED):
        assert sentence in text
    for warning in remarks(recording, decoding):
        assert text.count(warning) == 1
    assert hashlib.sha256(b"0 1 2 3\n").hexdigest() in text
    assert hashlib.sha256(b"a fake key file\n").hexdigest() in text
    assert "mtm-audit decode 'my film.tum'" in text
    assert f"NumPy {np.__version__}" in text
    assert "2099-01-01 00:00:00 +00:00 (UTC)" in text


def test_a_page_without_a_message_shows_no_symbol(page_of):
    text = Page(page_of(*under_another_key())).text
    for chance in ("symbol scored", "ahead of the next", "message begins", "Evidence against time", "margin"):
        assert chance not in text
    assert "not that none was sent" in text


def test_every_picture_names_recording_key_and_date(page_of):
    svgs = page_of(*both_sent()).split("<svg")[1:]
    assert len(svgs) == 5
    for svg in svgs:
        assert "recording motion.tum · key fake (scheme test, " in svg
        assert f"drawn {datetime.now():%Y-%m-%d}" in svg


@pytest.mark.parametrize(
    "name", ['<script>alert("x")</script>', "body[left]", "$a$ & b", "\x1b[31m_x", "机器人", "[/]"]
)
def test_names_are_shown_and_never_obeyed(page_of, name):
    recording, decoding = decoding_of(track(0, symbol=3), replace(track(1, symbol=1), name=name))
    page = Page(page_of(recording, decoding))
    assert page.tags.count("script") == 0
    assert name.replace("\x1b", "\ufffd") in page.text


def test_no_identifier_is_in_a_page_twice_that_is_referred_to(page_of):
    html = page_of(*both_sent())
    for reference in {reference for reference in Page(html).references if reference.startswith("#")}:
        assert f'id="{reference[1:]}"' in html


@pytest.mark.parametrize("name", ["robot.key", "report", "report.pdf"])
def test_a_report_must_be_named_like_a_page(name):
    with pytest.raises(MtmError, match="end it in .html or .htm"):
        check_report_path(Path(name))


def test_a_page_that_breaks_off_leaves_the_former_one(tmp_path):
    (tmp_path / "report.html").write_text("the former one")
    with pytest.raises(UnicodeEncodeError):
        write_page(tmp_path / "report.html", "a lone \ud800")
    assert [path.read_text() for path in tmp_path.iterdir()] == ["the former one"]


def test_very_many_pictures_have_one_hash(tmp_path):
    folder = tmp_path / "pictures"
    folder.mkdir()
    for number in range(30):
        (folder / f"{number:03}.png").write_bytes(bytes([number]))
    (only,) = provenance_of(ReportRequest(tmp_path / "r.html", (), (), LATER), [folder]).files
    lines = [f"{hashlib.sha256(bytes([n])).hexdigest()}  {n:03}.png\n" for n in range(30)]
    assert only.sha256 == hashlib.sha256("".join(lines).encode()).hexdigest()
    assert "30 files" in only.name
    assert only.size_bytes == 30


def test_a_file_that_changed_meanwhile_is_warned_of(tmp_path):
    film = tmp_path / "film.mp4"
    film.write_bytes(b"x")
    before = datetime.now(UTC) - timedelta(minutes=1)
    assert "film.mp4 was written to" in provenance_of(ReportRequest(film, (), (), before), [film]).warnings[0]
    assert provenance_of(ReportRequest(film, (), (), LATER), [film]).warnings == ()


def test_an_input_that_is_gone_is_one_sentence(tmp_path):
    with pytest.raises(MtmError, match="cannot be read any more"):
        provenance_of(ReportRequest(tmp_path / "r.html", (), (), LATER), [tmp_path / "gone.mp4"])


def test_a_request_takes_the_command_line_of_the_process(tmp_path, monkeypatch):
    monkeypatch.setattr(sys, "argv", ["mtm-audit", "decode", "a b"])
    request = requested(tmp_path / "r.html", None, {"key": tmp_path / "robot.key", "anchor": None})
    assert request.command == "mtm-audit decode 'a b'"
    assert request.inputs == (("key", tmp_path / "robot.key"),)
