from pathlib import Path

import pytest

from mtm_audit.batch.found import find_recordings

LOG = "# time x y\n" + "".join(f"{row / 100:.2f} {row / 50:.3f} 0 0 0 0 0 1\n" for row in range(20))


@pytest.fixture
def lab(tmp_path, monkeypatch):
    """A folder with films, logs and folders of both."""
    monkeypatch.chdir(tmp_path)

    def make(*names):
        for name in names:
            path = tmp_path / name
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_bytes(LOG.encode() if path.suffix == ".tum" else b"\1\2\3")

    return make


def find(*names, out="results.csv"):
    return find_recordings([Path(name) for name in names], Path(out))


def told(items):
    """Name and number of files of each, 0 for one that cannot be read."""
    return [(item.name, 0 if item.source is None else len(item.source.files)) for item in items]


def test_files_are_recordings_in_the_order_given(lab):
    lab("b.mp4", "a.tum", "c.tum")
    assert told(find("c.tum", "b.mp4", "a.tum")) == [("c.tum", 1), ("b.mp4", 1), ("a.tum", 1)]


def test_a_folder_holds_films_its_logs_together_and_folders(lab):
    lab("lab/b.mp4", "lab/a.mp4", "lab/robot0.tum", "lab/robot1.tum", "lab/day/c.tum", "lab/.hidden/d.tum")
    assert told(find("lab")) == [("lab/a.mp4", 1), ("lab/b.mp4", 1), ("lab", 2), ("lab/day/c.tum", 1)]


def test_a_recording_that_is_named_twice_is_found_once(lab):
    lab("lab/a.mp4", "lab/b.mp4")
    assert told(find("lab/b.mp4", "lab", "lab/../lab/a.mp4"))[:2] == [("lab/b.mp4", 1), ("lab/a.mp4", 1)]


def test_chapters_are_one_film_and_a_missing_one_spares_others(lab):
    lab("GX010001.MP4", "GX020001.MP4", "GX010002.MP4", "GX030002.MP4", "z.mp4")
    whole, broken, other = find(".")
    assert told([whole, broken, other]) == [("GX010001.MP4", 2), ("GX010002.MP4", 0), ("z.mp4", 1)]
    assert "what lies between them is missing" in broken.refusal


def test_pictures_of_a_folder_are_one_film(lab):
    lab("film/1.png", "film/2.png", "film/more/a.tum", "single/1.png")
    assert told(find("film")) == [("film", 1), ("film/more/a.tum", 1)]
    assert told(find("film/1.png", "film/2.png", "single/1.png")) == [("film/1.png", 2), ("single/1.png", 0)]


def test_each_path_that_cannot_be_read_says_why(lab):
    lab("a.tum")
    Path("empty.tum").touch()
    Path("folder/deeper").mkdir(parents=True)
    good, *bad = find("a.tum", "empty.tum", "missing.mp4", "folder")
    assert good.refusal == ""
    assert [item.source for item in bad] == [None] * 3
    for item, reason in zip(bad, ("is empty", "No such file", "holds no recording that is read"), strict=True):
        assert reason in item.refusal


def test_the_table_itself_is_no_recording(lab):
    lab("lab/a.tum")
    Path("lab/results.csv").write_text("time,x,y\n" + "".join(f"{row},{row},{row}\n" for row in range(9)))
    assert told(find("lab", out="lab/results.csv")) == [("lab/a.tum", 1)]
    assert told(find("lab", out="other.csv")) == [("lab", 2)]


def test_links_do_not_lead_in_a_circle(lab):
    lab("lab/a.tum")
    Path("lab/back").symlink_to(Path("lab").absolute())
    assert told(find("lab")) == [("lab/a.tum", 1)]


def test_paths_are_absolute_for_processes_elsewhere(lab):
    lab("a.tum", "b.mp4")
    assert all(file.is_absolute() for item in find("a.tum", "b.mp4") for file in item.source.files)
