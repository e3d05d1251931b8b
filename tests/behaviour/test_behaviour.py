import stat

import pytest

from tests.behaviour.__main__ import main
from tests.behaviour.commands import COMMANDS, Command
from tests.behaviour.comparison import differences, differing_lines
from tests.behaviour.inputs import write_inputs
from tests.behaviour.normalise import normalised
from tests.behaviour.program import ROOT, Outcome
from tests.behaviour.transcript import missing, transcript

COPY = Command("copy", "mtm-audit copy a.csv", writes=("b.csv",), copies=(("first/a.csv", "a.csv"),))


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("wrote {folder}/made/a.csv\n", "wrote FOLDER/made/a.csv\n"),
        ("{root}/hil/cli.py:3: a warning", "CHECKOUT/hil/cli.py:3: a warning"),
        ("its cells took 12 minutes of one core", "its cells took ELAPSED of one core"),
        ("it took 0.25 s", "it took ELAPSED"),
        ("9 s of motion, slot of 2026-01-31 12:00:04 UTC", "9 s of motion, slot of 2026-01-31 12:00:04 UTC"),
        ("a\nMatplotlib is building the font cache; this may take a moment.\nb", "a\nb"),
        ("no newline at the end, \r and ±", "no newline at the end, \r and ±"),
    ],
)  # fmt: skip
def test_paths_and_elapsed_times_are_taken_out_and_nothing_else(tmp_path, text, wanted):
    assert normalised(text.format(folder=tmp_path, root=ROOT).encode(), tmp_path) == wanted


@pytest.mark.parametrize("data", [b"\xff\xd8", b"a\0b"])
def test_what_is_no_text_is_not_normalised(tmp_path, data):
    assert normalised(data, tmp_path) is None


def test_a_transcript_has_exit_code_words_and_files(tmp_path):
    for name, data in {"a.csv": b"1\n", "b.csv": b"2", "cells.jsonl": b"{}\n"}.items():
        (tmp_path / name).write_bytes(data)
        (tmp_path / name).chmod(0o640)
    text = transcript(COPY, Outcome(3, b"done\n", b"\0"), tmp_path, tmp_path)
    assert text.split("\n") == [
        "$ mtm-audit copy a.csv",
        "exit code 3",
        "stdout:",
        "| done",
        "| ",
        "stderr: 1 bytes, SHA-256 6e340b9cffb37a989ca544e6bb780a2c78901d3fb33738768511a30617afa01d",
        "b.csv, mode 0640:",
        "| 2",
        "cells.jsonl: written and not compared",
        "",
    ]
    assert missing(COPY, tmp_path) == []


def test_a_file_that_was_not_written_is_missed(tmp_path):
    assert "\nb.csv was not written\n" in transcript(COPY, Outcome(0, b"", b""), tmp_path, tmp_path)
    assert missing(COPY, tmp_path) == ["b.csv"]


def test_only_the_first_lines_that_differ_are_shown():
    assert differing_lines("a\nb\n", "a\nb\n") == []
    assert differing_lines("a\nb\nc", "a\nx\nc\nd") == ["line 2:", "  - b", "  + x", "line 4:", "  + d"]
    assert differing_lines("a\n", "a") == ["line 2:", "  - "]
    assert differing_lines("a\r\n", "a\n") == ["line 1:", "  - a\r", "  + a"]
    shown = differing_lines("\n".join("abcdefgh"), "\n".join("ABCDEFGH"))
    assert (len(shown), shown[-1]) == (16, "and 3 more lines")


@pytest.fixture
def recordings(tmp_path):
    for name, texts in {"before": ("1\n", "2\n"), "after": ("1\n", "2\n")}.items():
        (tmp_path / name).mkdir()
        for command, text in zip(("first", "second"), texts, strict=True):
            (tmp_path / name / f"{command}.txt").write_text(text)
    return tmp_path / "before", tmp_path / "after"


def test_equal_recordings_end_with_0_and_others_with_1(recordings, capsys):
    before, after = recordings
    assert main(["compare", str(before), str(after)]) == 0
    assert capsys.readouterr().out == "all commands did the same\n"
    (after / "second.txt").write_text("3\n")
    assert main(["compare", str(before), str(after)]) == 1
    assert capsys.readouterr().out == "second differs:\n  line 1:\n    - 2\n    + 3\n1 commands differ\n"


def test_a_command_that_one_recording_lacks_is_a_difference(recordings):
    before, after = recordings
    (before / "first.txt").unlink()
    assert differences(before, after) == {"first": [f"{before / 'first.txt'} is missing"]}
    assert differences(after, before) == {"first": [f"{before / 'first.txt'} is missing"]}


def test_wrong_usage_ends_with_2(tmp_path):
    for arguments in ([], ["record", str(tmp_path)], ["compare", str(tmp_path), str(tmp_path)]):
        with pytest.raises(SystemExit) as ending:
            main(arguments)
        assert ending.value.code == 2


def test_fake_keys_look_fake_and_only_one_is_readable_by_others(tmp_path):
    write_inputs(tmp_path / "inputs")
    modes = {path.name: stat.S_IMODE(path.stat().st_mode) for path in (tmp_path / "inputs").glob("*.key")}
    assert modes == {"fleet.key": 0o600, "other.key": 0o600, "courier.key": 0o600, "readable-by-all.key": 0o644}
    assert f'secret = "{"11" * 32}"' in (tmp_path / "inputs" / "fleet.key").read_text()


def test_thirty_commands_read_what_came_before():
    names = [command.name for command in COMMANDS]
    assert len(set(names)) == 30
    for number, command in enumerate(COMMANDS):
        read = [part.split("/")[1] for part in command.argv if part.startswith("../")]
        read += [source.split("/")[0] for source, _ in command.copies]
        assert set(read) <= {"inputs", *names[:number]}, command.name
