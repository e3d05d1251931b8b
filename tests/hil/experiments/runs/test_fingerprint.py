import pytest

from hil.experiments.runs.fingerprint import code_fingerprint


def project(folder, contents):
    """A folder of packages with these files."""
    for name, content in contents.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(content)
    return folder


FILES = {"hil/a.py": "one", "mtm_audit/b.py": "two", "hil/plants/plant.toml": "slip = 1", "hil/notes.txt": "aside"}


@pytest.mark.parametrize("name", ["hil/a.py", "mtm_audit/b.py", "hil/plants/plant.toml"])
def test_a_change_of_code_or_of_a_plant_shows(tmp_path, name):
    before = code_fingerprint(project(tmp_path / "before", FILES))
    assert code_fingerprint(project(tmp_path / "after", FILES | {name: "changed"})) != before


def test_the_place_and_other_files_make_no_difference(tmp_path):
    before = code_fingerprint(project(tmp_path / "before", FILES))
    assert code_fingerprint(project(tmp_path / "after", FILES | {"hil/notes.txt": "changed", "x.py": "new"})) == before


def test_it_is_sixteen_hexadecimal_digits():
    assert len(code_fingerprint()) == 16
    assert int(code_fingerprint(), 16) >= 0
