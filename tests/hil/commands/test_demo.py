import io
import json
import sys

import pytest
from rich.console import Console

from hil.cli import main
from hil.commands import demo as module
from hil.commands.demo import MESSAGE, demo
from mtm_onboard.protocol import MtmError

# In the place of the programs: it makes what they would make, and answers as the auditor would or as ANSWERS says.
PROGRAM = """\
#!{python}
import json, os, pathlib, sys
name, arguments = os.path.basename(sys.argv[0]), " ".join(sys.argv[1:])
answers = json.loads(pathlib.Path(__file__).with_name("answers.json").read_text())
for part, (code, text) in answers.items():
    if part in name + " " + arguments:
        print(text)
        print("a sentence", file=sys.stderr)
        sys.exit(code)
"""


def answer(verdict, message=None):
    return {"decoded": 0, "absent": 3, "inconclusive": 4}[verdict], json.dumps({"verdict": verdict, "message": message})


GOOD = {
    "message/video.mp4": answer("decoded", MESSAGE),
    "other.key --json": answer("absent"),
    "message/mocap": answer("decoded", MESSAGE),
    "silent/mocap": answer("absent"),
}


@pytest.fixture
def programs(tmp_path, monkeypatch):
    folder = tmp_path / "programs"
    folder.mkdir()

    def set_answers(answers):
        (folder / "answers.json").write_text(json.dumps(answers))
        for name in ("mtm-onboard", "mtm-hil", "mtm-audit"):
            (folder / name).write_text(PROGRAM.format(python=sys.executable))
            (folder / name).chmod(0o755)

    monkeypatch.setattr(module, "program", lambda name: str(folder / name))
    return set_answers


def run(out):
    console = Console(file=io.StringIO(), width=100)
    return demo(out, console), console.file.getvalue()


def test_the_demo_is_good_when_only_the_right_key_reads(programs, tmp_path, capfd):
    programs(GOOD)
    is_good, text = run(tmp_path / "demo")
    assert is_good
    assert text.count("10110010 (178)") == 3
    assert text.count("as it should be") == 4
    assert f"told in {tmp_path / 'demo' / 'report.html'}" in capfd.readouterr().out


@pytest.mark.parametrize(
    ("part", "wrong"),
    [
        ("message/video.mp4", answer("decoded", 177)),
        ("message/mocap", answer("inconclusive")),
        ("other.key --json", answer("decoded", MESSAGE)),
        ("silent/mocap", answer("inconclusive")),
    ],
)
def test_one_wrong_verdict_makes_the_demo_fail(programs, tmp_path, capfd, part, wrong):
    programs(GOOD | {part: wrong})
    with pytest.raises(SystemExit) as ending:
        main(["demo", "--out", str(tmp_path / "demo")])
    assert ending.value.code == 1
    assert capfd.readouterr().out.count("WRONG") == 1
    assert (tmp_path / "demo").is_dir()


@pytest.mark.parametrize(
    ("answers", "sentence"),
    [
        (GOOD | {"message/video.mp4": (1, "")}, r"'mtm-audit decode message/video.mp4.*code 1 \(a sentence\)"),
        ({"mtm-hil record": (130, ""), **GOOD}, r"'mtm-hil record.*code 130"),
        (GOOD | {"message/video.mp4": (0, "decoded")}, "gave no verdict"),
    ],
)
def test_a_program_that_fails_ends_the_demo_and_leaves_nothing(programs, tmp_path, answers, sentence):
    programs(answers)
    with pytest.raises(MtmError, match=sentence):
        run(tmp_path / "demo")
    assert [path.name for path in tmp_path.iterdir()] == ["programs"]


def test_a_folder_that_exists_is_refused_before_anything_runs(programs, tmp_path):
    with pytest.raises(MtmError, match="exists already"):
        run(tmp_path)
