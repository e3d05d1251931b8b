"""What one recording's rows say, by the function that worker processes run."""

from dataclasses import replace

import pytest

from mtm_audit.batch import reading, told
from mtm_audit.batch.found import Found
from mtm_audit.batch.reading import Work, read_rows
from mtm_audit.decoding.decode import decode_tracks
from mtm_audit.ingest.recording import read_recording
from mtm_audit.ingest.source import Source
from mtm_onboard.protocol import MtmError, save_key
from mtm_onboard.protocol.key import Key
from tests.audit.batch.recordings import KEY, SETTINGS, found_at, plan_of, record, save_keys


@pytest.fixture(scope="module")
def lab(tmp_path_factory):
    """A folder with both keys, a recording of each, and one without a message."""
    folder = tmp_path_factory.mktemp("lab")
    save_keys(folder)
    save_key(Key("copy", KEY.secret, KEY.scheme), folder / "copy.key")
    record(folder / "sent.tum", 3)
    record(folder / "silent.tum", None)
    return folder


def plan(lab, *names, **changes):
    return plan_of([lab / f"{name}.key" for name in names], changes.pop("cache", lab / "cache"), **changes)


def rows_of(lab, name, *keys, **changes):
    return read_rows(Work(plan(lab, *keys, **changes), found_at(lab / name)))


def test_a_row_says_what_a_decode_says(lab):
    (row,) = rows_of(lab, "sent.tum", "fake")
    decoding = decode_tracks(read_recording([lab / "sent.tum"], "motion capture").tracks, KEY, SETTINGS)
    assert (
        (row.verdict, row.message, row.message_kind) == (decoding.verdict, "3", "number") == ("decoded", "3", "number")
    )
    assert (row.bits, row.chance) == (f"{decoding.evidence.bits:.2f}", f"{decoding.evidence.p_value:.3g}")
    assert (row.key_id, row.keys_tried, row.rows, row.error) == ("fake", "1", "1", "")
    assert float(row.duration_s) == pytest.approx(7.6)


def test_several_keys_cost_their_logarithm_in_bits(lab):
    (alone,), (one_of_two,) = rows_of(lab, "sent.tum", "fake"), rows_of(lab, "sent.tum", "other", "fake")
    assert float(one_of_two.bits) == pytest.approx(float(alone.bits) - 1.0, abs=0.011)
    assert float(one_of_two.chance) == pytest.approx(2.0 * float(alone.chance), rel=0.01)
    assert (one_of_two.key, one_of_two.keys_tried) == (str(lab / "fake.key"), "2")


def test_evidence_that_one_key_needs_is_too_little_for_two(lab):
    """At a threshold between what is there and what two keys leave of it."""
    (alone,) = rows_of(lab, "sent.tum", "fake", settings=replace(SETTINGS, threshold=0.5))
    limit = 1.5 * float(alone.chance)
    asked = replace(SETTINGS, threshold=limit)
    assert rows_of(lab, "sent.tum", "fake", settings=asked)[0].verdict != "absent"
    assert rows_of(lab, "sent.tum", "fake", "other", settings=asked)[0].verdict == "absent"


def test_absent_rows_of_several_keys_name_none(lab):
    (row,) = rows_of(lab, "silent.tum", "fake", "other")
    assert (row.verdict, row.key, row.key_id, row.message) == ("absent", "", "", "")
    bits = [float(rows_of(lab, "silent.tum", name)[0].bits) for name in ("fake", "other")]
    assert float(row.bits) == pytest.approx(max(bits) - 1.0, abs=0.011)
    assert rows_of(lab, "silent.tum", "fake")[0].key == str(lab / "fake.key")


def test_each_key_that_shows_something_has_a_row(lab):
    rows = rows_of(lab, "sent.tum", "fake", "other", "copy")
    assert [(row.key_id, row.verdict, row.rows) for row in rows] == [("fake", "decoded", "1"), ("copy", "decoded", "1")]


def test_a_key_that_cannot_be_tried_is_told_beside_the_others(lab):
    """A rolling key needs to know when the recording was made, and motion capture does not say."""
    save_key(Key("rolling", KEY.secret, replace(KEY.scheme, schedule="rolling")), lab / "rolling.key")
    (row,) = rows_of(lab, "sent.tum", "fake", "rolling")
    assert row.verdict == "decoded"
    assert "rolling.key: " in row.warnings
    (refused,) = rows_of(lab, "sent.tum", "rolling")
    assert (refused.verdict, refused.key, refused.bits) == ("unreadable", "", "")
    assert "--at" in refused.error


@pytest.fixture
def film(lab, tmp_path, monkeypatch):
    """A film, whose tracks are those of the log here, and a list to which each reading of it adds."""
    readings = []

    def tracked(files, kind, *arguments, **options):
        readings.append(kind)
        log = read_recording([lab / "sent.tum"], "motion capture")
        return replace(log, paths=tuple(files), kind=kind, warnings=(f"{files[0]} is dark",))

    monkeypatch.setattr(reading, "read_recording", tracked)
    monkeypatch.setattr("mtm_audit.decoding.recorded.film_compression", lambda files: None)
    path = tmp_path / "film.mp4"
    path.write_bytes(b"pictures")

    def rows_under(name, path=path, **changes):
        work = Work(plan(lab, name, cache=tmp_path / "cache", **changes), Found(str(path), Source((path,), "video")))
        return [replace(row, seconds="", run="") for row in read_rows(work)]

    return rows_under, readings, path


def test_a_second_key_takes_the_tracks_of_the_first(film, tmp_path):
    rows_under, readings, path = film
    first, again, other = rows_under("fake"), rows_under("fake"), rows_under("other")
    assert (first, [row.verdict for row in first + other]) == (again, ["decoded", "absent"])
    assert readings == ["video"]
    (tmp_path / "usb").mkdir()
    copy = tmp_path / "usb" / path.name
    copy.write_bytes(path.read_bytes())
    assert f"{copy} is dark" in rows_under("fake", copy)[0].warnings
    assert len(readings) == 1


@pytest.mark.parametrize(
    "changes", [{"tracker": "colour:red"}, {"frame_rate_hz": 60.0}, {"reference": ("marker4",)}, {}],
    ids=["tracker", "rate", "reference", "pictures"],
)  # fmt: skip
def test_tracks_of_another_question_are_not_taken(film, changes):
    rows_under, readings, path = film
    rows_under("fake")
    if not changes:
        path.write_bytes(b"other pictures")
    rows_under("fake", **changes)
    assert len(readings) == 2


def test_tracks_of_other_code_are_not_taken(film, monkeypatch):
    rows_under, readings, _ = film
    rows_under("fake")
    monkeypatch.setattr(reading, "reading_fingerprint", lambda: "0" * 16)
    rows_under("fake")
    assert len(readings) == 2


def test_a_damaged_entry_of_the_cache_is_made_anew(film, tmp_path):
    rows_under, readings, _ = film
    first = rows_under("fake")
    (entry,) = (tmp_path / "cache").iterdir()
    whole = entry.read_bytes()
    entry.write_bytes(whole[:1000])
    assert rows_under("fake") == first
    assert (len(readings), entry.read_bytes()) == (2, whole)


def test_a_folder_that_cannot_be_written_only_costs_time(film, tmp_path):
    rows_under, readings, _ = film
    (tmp_path / "cache").write_text("no folder")
    assert rows_under("fake") == rows_under("fake")
    assert len(readings) == 2


def test_logs_are_read_each_time_with_what_lies_beside_them(lab, tmp_path):
    rows_of(lab, "sent.tum", "fake", cache=tmp_path / "cache")
    assert not (tmp_path / "cache").exists()


def test_what_has_not_changed_is_not_read_again(lab):
    (row,) = rows_of(lab, "sent.tum", "fake")
    work = Work(plan(lab, "fake"), found_at(lab / "sent.tum"), known_sha256=row.sha256)
    assert read_rows(work) is None
    assert read_rows(replace(work, known_sha256="0" * 64))[0].verdict == "decoded"


@pytest.mark.parametrize("error", [MemoryError(), ValueError("odd\nfile"), RecursionError(), OSError(5, "I/O error")])
def test_whatever_fails_in_one_recording_is_its_row(lab, monkeypatch, error):
    monkeypatch.setattr(told, "decode_recording", lambda *arguments: (_ for _ in ()).throw(error))
    (row,) = rows_of(lab, "sent.tum", "fake")
    assert (row.verdict, len(row.sha256)) == ("unreadable", 64)
    assert type(error).__name__ in row.error
    assert row.error.isprintable()


def test_a_damaged_file_says_why_in_its_row(lab):
    (lab / "bad.mp4").write_bytes(bytes(999))
    work = Work(plan(lab, "fake"), replace(found_at(lab / "bad.mp4")))
    (row,) = read_rows(replace(work, found=replace(work.found, source=replace(work.found.source, kind="video"))))
    assert row.verdict == "unreadable"
    assert "is not a video that can be read" in row.error


def test_another_version_elsewhere_ends_the_batch(lab):
    with pytest.raises(MtmError, match="another version of the program or its libraries; install the same everywhere"):
        rows_of(lab, "sent.tum", "fake", code="0" * 16)
