import os
import re
import subprocess
import sys
import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mtm_audit.cli import main
from mtm_audit.detectors.matched.axis_response import AxisResponse
from mtm_audit.detectors.matched.plants import FINE
from mtm_audit.detectors.matched.profile import PlantProfile, save_profile
from mtm_audit.planning.table import AccuracyPoint, AccuracyTable, read_table, write_table
from mtm_onboard.cli import main as onboard
from mtm_onboard.protocol import Channel, Key, Scheme, load_key, save_key
from mtm_onboard.protocol.schemefile import load_scheme
from tests.audit.planning.paper import paper_table

LANDER = paper_table("lander")
JOB = ("--bits", "10", "--rate", "50", "--alphabet", "4", "--measured-only")


@pytest.fixture
def folder(tmp_path):
    write_table(tmp_path / "lander.csv", LANDER)
    channels = tuple(Channel(name, "lander", (name,), 1, 0.5) for name in ("x", "y"))
    scheme = Scheme(
        name="lander",
        rate_hz=50.0,
        band_hz=(0.5, 5.0),
        alphabet_size=8,
        message_ticks=300,
        channels=channels,
        power="ensemble",
    )
    save_key(Key("fake", b"not a real secret, only for test", scheme), tmp_path / "lander.key")
    return tmp_path


@pytest.fixture
def audit(folder, capsys, monkeypatch):
    """Run mtm-audit in the folder; gives the exit code, standard output and standard error."""
    monkeypatch.chdir(folder)

    def run(*arguments):
        with pytest.raises(SystemExit) as left:
            main([*map(str, arguments)])
        out, err = capsys.readouterr()
        assert "Traceback" not in out + err
        return left.value.code or 0, out, err

    return run


def test_a_plan_names_the_fastest_scheme_first(audit):
    code, out, err = audit("plan", "lander.csv", *JOB)
    assert (code, err) == (0, "")
    lines = out.splitlines()
    assert lines[0] == "fastest for 10 bits at 0.9: split, M = 4, T = 576 (11.52 s)"
    titles = "scheme M L T seconds bits/s accuracy interval symbols"
    assert [word for word in lines[1].split() if word in titles.split()] == titles.split()
    assert [line.split()[:6] for line in lines[2:5]] == [
        ["single", "4", "5", "1200", "24.00", "0.417"],
        ["same", "4", "5", "960", "19.20", "0.521"],
        ["split", "4", "5", "576", "11.52", "0.868"],
    ]
    assert "0.912" in lines[4]
    assert lines[4].rstrip().endswith("x 2 x 288, y 3 x 192")
    assert any(line.startswith("split: RS(5,3) over GF(16), which corrects 1, would take T = 1152") for line in lines)
    assert not any("interpolated" in line for line in lines)


def test_interpolation_is_said(audit):
    assert "lie between measured ones, so the accuracy is interpolated" in audit("plan", "lander.csv", *JOB[:-1])[1]


def test_the_scheme_file_is_provisioned_as_a_key(audit, folder):
    code, out, _ = audit("plan", "lander.csv", *JOB[:2], *JOB[4:], "--like", "lander.key", "--out", "plan.toml")
    assert code == 0
    assert "wrote plan.toml: scheme " in out
    assert onboard(["keygen", "--id", "fake-key", "--scheme", "plan.toml", "--out", "planned.key"]) == 0
    scheme = load_key(folder / "planned.key").scheme
    assert (scheme.alphabet_size, scheme.message_ticks, scheme.combine) == (4, 576, "split")
    assert [(channel.name, channel.body, channel.symbols) for channel in scheme.channels] == [
        ("x", "lander", 2), ("y", "lander", 3),
    ]  # fmt: skip
    assert (scheme.band_hz, scheme.power) == ((0.5, 5.0), "ensemble")


def test_another_strategy_can_be_written(audit):
    chosen = ("--like", "lander.key", "--out", "plan.toml", "--strategy", "same")
    assert audit("plan", "lander.csv", *JOB[:2], *JOB[4:], *chosen)[0] == 0
    with open("plan.toml", "rb") as file:
        scheme = tomllib.load(file)["scheme"]
    assert (scheme["combine"], scheme["message_ticks"]) == ("same", 960)
    assert [channel["symbols"] for channel in scheme["channels"]] == [5, 5]


def held_out(change):
    """The Lander's table with other successes."""
    points = [
        AccuracyPoint(p.channel, p.alphabet_size, p.window_ticks, change(p.successes, p.trials), p.trials)
        for p in LANDER.points
    ]
    return AccuracyTable(tuple(points))


def test_a_check_says_whether_held_out_measurements_agree(audit):
    write_table(Path("near.csv"), held_out(lambda right, of: min(of, right + 2)))
    code, out, _ = audit("plan", "lander.csv", *JOB, "--check", "near.csv")
    assert code == 0
    assert out.count("at exactly these windows: the intervals agree") == 3
    write_table(Path("far.csv"), held_out(lambda right, of: right // 2))
    code, out, _ = audit("plan", "lander.csv", *JOB, "--check", "far.csv")
    assert code == 4
    assert "split: predicted 0.912 [" in out
    assert out.count("the intervals do NOT agree") == 3


def test_a_check_that_reaches_no_window_names_the_one_to_measure(audit):
    write_table(Path("short.csv"), AccuracyTable(tuple(p for p in LANDER.points if p.window_ticks < 100)))
    code, out, err = audit("plan", "lander.csv", *JOB, "--check", "short.csv")
    assert (code, out) == (1, "")
    assert "says nothing of x at M = 4 in windows of 240 ticks; measure that cell" in err


def test_a_check_of_one_scheme_leaves_the_others_and_says_so(audit):
    cells = {("x", 4, 288), ("y", 4, 192)}
    split = [point for point in LANDER.points if (point.channel, point.alphabet_size, point.window_ticks) in cells]
    write_table(Path("split.csv"), AccuracyTable(tuple(split)))
    code, out, _ = audit("plan", "lander.csv", *JOB, "--check", "split.csv")
    assert code == 0
    assert out.count("not checked, since the held-out table does not have its windows") == 2
    assert "split: predicted 0.912" in out


@pytest.mark.parametrize("suffix", ["png", "pdf", "svg"])
def test_a_picture_is_drawn(audit, suffix):
    code, out, _ = audit("plan", "lander.csv", *JOB[:-1], "--plot", f"plan.{suffix}")
    assert code == 0
    assert out.endswith(f"wrote plan.{suffix}\n")
    assert Path(f"plan.{suffix}").stat().st_size > 5000


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (("--bits", "5000", "--rate", "50"), "send a longer payload in several messages"),
        (("--bits", "10", "--rate", "50", "--accuracy", "1.2"), "choose one above 0 and below 1"),
        (("--bits", "10", "--rate", "50", "--accuracy", "0.99999"), "lower the target, shorten the payload, or"),
        (("--bits", "10", "--rate", "50", "--alphabet", "16"), "the table has no M = 16; choose of 2, 4, 8"),
        (("--bits", "10", "--rate", "50", "--out", "plan.toml"), "give a key of these robots with --like"),
        (("--bits", "10", "--rate", "50", "--plot", "plan.doc"), "is no picture format"),
        (("--bits", "10", "--rate", "50", "--check", "none.csv"), "cannot read the accuracy table none.csv"),
        (("--bits", "10", "--like", "lander.csv"), "lander.csv is no key file"),
    ],
)
def test_what_cannot_be_planned_is_refused_with_nothing_written(audit, folder, options, says):
    before = sorted(os.listdir(folder))
    code, out, err = audit("plan", "lander.csv", *options)
    wrong = {"send a longer payload in several messages", "choose one above 0 and below 1", "is no picture format"}
    assert (code, out) == (2 if says in wrong else 1, "")
    assert err.startswith("mtm-audit: ")
    assert err.count("\n") == 1
    assert says in err
    assert sorted(os.listdir(folder)) == before


def test_a_key_without_the_plan_s_channels_is_refused(audit, folder):
    write_table(folder / "other.csv", AccuracyTable((AccuracyPoint("z", 4, 100, 99, 100),)))
    code, _, err = audit("plan", "other.csv", "--bits", "2", "--like", "lander.key", "--out", "plan.toml")
    assert code == 1
    assert "no channel 'z'; choose one of: x, y" in err
    assert not (folder / "plan.toml").exists()


@pytest.mark.parametrize("options", [(), ("--rate", "50", "--like", "lander.key")])
def test_the_rate_comes_from_one_place(audit, options):
    code, _, err = audit("plan", "lander.csv", "--bits", "10", *options)
    assert code == 2
    assert "--rate" in err


def test_a_plan_that_breaks_off_leaves_the_former_scheme(audit, folder, monkeypatch):
    def interrupted(*_args, **_kwargs):
        raise KeyboardInterrupt

    (folder / "plan.toml").write_text("# mtm-audit plan: the former one")
    monkeypatch.setattr("mtm_onboard.protocol.schemefile.scheme_text", interrupted)
    code, out, err = audit("plan", "lander.csv", *JOB[:2], *JOB[4:], "--like", "lander.key", "--out", "plan.toml")
    assert (code, out) == (130, "")
    assert err == "mtm-audit: interrupted; nothing was written\n"
    assert (folder / "plan.toml").read_text() == "# mtm-audit plan: the former one"
    assert not [name for name in os.listdir(folder) if name.startswith(".")]


def test_an_interval_below_the_target_is_told_and_sure_lifts_it(audit):
    _, plain, _ = audit("plan", "lander.csv", *JOB)
    begins = re.search(r"split: its interval begins at (0\.\d+), below the target; --sure plans", plain)
    assert float(begins[1]) < 0.9
    code, sure, _ = audit("plan", "lander.csv", *JOB[:-1], "--sure")
    assert code == 0
    assert sure.startswith("fastest for 10 bits at 0.9 surely: ")
    assert "below the target; --sure" not in sure
    lasts = [float(re.search(r"T = (\d+)", text)[1]) for text in (plain, sure)]
    assert lasts[0] < lasts[1]


def test_a_plan_that_no_window_makes_sure_is_refused(audit):
    code, _, err = audit("plan", "lander.csv", *JOB[:-1], "--accuracy", "0.97", "--sure")
    assert code == 1
    assert "0.97 surely: the interval of the best begins at 0.956" in err


@pytest.mark.parametrize(("trials", "code"), [(2, 1), (4, 1), (10, 0)])
def test_trials_too_few_for_the_target_are_refused(audit, trials, code):
    points = [AccuracyPoint("x", 4, ticks, trials, trials) for ticks in (100, 200)]
    write_table(Path("few.csv"), AccuracyTable(tuple(points)))
    ended, _, err = audit("plan", "few.csv", "--bits", "2", "--rate", "50", "--accuracy", "0.9")
    assert ended == code
    assert ("measure about 10 or more of each window" in err) == bool(code)


def test_a_plan_names_the_scheme_that_it_makes(audit):
    code, out, _ = audit("plan", "lander.csv", *JOB[:2], *JOB[4:], "--like", "lander.key", "--out", "plan.toml")
    assert code == 0
    name, fingerprint = re.search(r"wrote plan.toml: scheme (\S+) \(fingerprint ([0-9a-f]{16})\)", out).groups()
    assert re.fullmatch(r"lander-split-M4-T\d+", name)
    made = load_scheme(Path("plan.toml"))
    assert (made.name, made.fingerprint) == (name, fingerprint)


def test_a_plan_is_written_again_and_over_nothing_else(audit, folder):
    wanted = (
        "plan",
        "lander.csv",
        *JOB[:2],
        *JOB[4:],
        "--like",
        "lander.key",
        "--out",
        "plan.toml",
        "--plot",
        "plan.png",
    )
    for _ in range(2):
        assert audit(*wanted)[0] == 0
    scheme = (folder / "plan.toml").read_text()
    (folder / "plan.toml").write_text(scheme.partition("\n")[2])
    code, out, err = audit(*wanted)
    assert (code, out) == (1, "")
    assert "plan.toml exists and was not made by mtm-audit plan" in err
    assert audit(*wanted, "--force")[0] == 0
    assert (folder / "plan.toml").read_text() == scheme


def test_duration_is_in_seconds(audit):
    code, out, _ = audit("duration", "lander.csv", "--key", "lander.key", "--accuracy", "0.9")
    assert code == 0
    # One window of 300 ticks on x and on y, M = 8: x has 99.8 % and y 99.3 % at 288.
    assert (
        out.splitlines()[0]
        == "12.00 s of motion, wherever in a message it begins (1 message of 300 ticks and one window)"
    )
    assert out.splitlines()[1] == "6.00 s when it begins with a message"
    assert "of 6 bits; 1 bits/s" in out


def test_a_payload_too_long_for_the_key_is_refused(audit):
    code, out, err = audit("duration", "lander.csv", "--key", "lander.key", "--bits", "7")
    assert (code, out) == (1, "")
    assert "a message of this key carries 1 to 6 bits" in err


def test_the_overhead_table_is_printed_as_in_the_paper(audit):
    code, out, _ = audit("overhead")
    assert code == 0
    assert [line.split() for line in out.splitlines()] == [
        ["errors", "best", "code", "M=8", "M=4", "M=2"],
        ["1", "RS(7,5)", "1.4x", "2.8x", "4.2x"],
        ["2", "RS(7,3)", "2.3x", "4.7x", "7.0x"],
        ["3", "RS(7,1)", "7.0x", "14x", "21x"],
    ]


def test_help_loads_neither_the_planner_nor_opencv():
    code = (
        "import sys\nfrom mtm_audit.cli import main\n"
        "try: main(['plan', '--help'])\nexcept SystemExit: pass\n"
        "print([n for n in ('scipy', 'cv2', 'mtm_audit.planning') if n in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"


def test_the_table_that_the_project_measured_can_be_planned_with(audit):
    path = Path(__file__).parents[3] / "results/accuracy_table.csv"
    assert len(read_table(path).channels) == 15
    assert audit("plan", path, "--bits", "8", "--rate", "50")[0] == 0


@pytest.fixture
def profile(folder):
    """A profile of robots that follow up to 1 Hz, on both axes of the key."""
    rows = tuple((hz, 1.0 / (1.0 + hz), 0.01) for hz in (0.3, 0.6, 1.2, 2.4, 4.8, 9.6))
    axes = tuple(AxisResponse(name, rows) for name in ("x", "y"))
    weights = np.full(len(FINE.taps), 1.0 / len(FINE.taps))
    save_profile(PlantProfile(weights, axes), folder / "rover.toml", "mtm-hil identify")
    return "rover.toml"


def test_a_profile_shapes_the_scheme(audit, profile):
    job = ("--bits", "10", "--alphabet", "4", "--measured-only", "--like", "lander.key")
    code, out, err = audit("plan", "lander.csv", *job, "--profile", profile, "--out", "plan.toml")
    assert (code, err) == (0, "")
    scheme = load_scheme(Path("plan.toml"))
    assert scheme.name == "lander-split-M4-T576-filled"
    points = ",".join(f"{hz:g}:{level_db:g}" for hz, level_db in scheme.spectrum)
    assert f"spectrum {points}: by capacity " in out
    assert onboard(["keygen", "--id", "fake", "--scheme", "plan.toml", "--out", "shaped.key"]) == 0
    assert load_key(Path("shaped.key")).scheme == scheme


def test_a_profile_needs_a_key_and_its_axes(audit, folder, profile):
    code, _, err = audit("plan", "lander.csv", *JOB, "--profile", profile)
    assert code == 2
    assert "give one with --like" in err
    weights = np.full(len(FINE.taps), 1.0 / len(FINE.taps))
    save_profile(PlantProfile(weights), folder / "bare.toml", "mtm-hil identify")
    job = ("--bits", "10", "--alphabet", "4", "--like", "lander.key")
    code, _, err = audit("plan", "lander.csv", *job, "--profile", "bare.toml", "--out", "plan.toml")
    assert code == 1
    assert "does not say how the axis x follows" in err
    assert not Path("plan.toml").exists()


def test_shaped_noise_may_be_better_than_predicted(audit, folder, profile):
    """A table of flat noise predicts the least that shaped noise reaches."""
    better = [replace(point, successes=point.trials) for point in LANDER.points]
    write_table(folder / "better.csv", AccuracyTable(tuple(better)))
    job = ("--bits", "10", "--alphabet", "4", "--measured-only", "--like", "lander.key", "--check", "better.csv")
    assert audit("plan", "lander.csv", *job)[0] == 4
    code, out, _ = audit("plan", "lander.csv", *job, "--profile", profile)
    assert code == 0
    assert "more than predicted, as noise that is shaped for these robots may be" in out
