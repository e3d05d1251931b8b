import hashlib
import inspect
import json
import os
import shutil
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import jsonschema
import numpy as np
import pytest

from hil.sensors.motion_capture import write_tum
from hil.sensors.video import write_video
from mtm_audit.cli import decode, main
from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.model.picture import Frame
from mtm_onboard.protocol import save_key
from tests.audit.moving_robot import FAKE_SECRET, OTHER_SECRET, key_of, robot_track, scheme_of
from tests.audit.readers.calibrations import camera_info
from tests.audit.readers.log_writers import write_rosbag2
from tests.audit.readers.moving_pose import driving
from tests.audit.small_films import SIZE, film, marker
from tests.patience import PATIENCE_S

KEY = key_of(scheme_of(symbols=(1, 1), ticks=400))
ROOT = Path(__file__).parents[2]
SCHEMA = json.loads((ROOT / "mtm_audit/reporting/decode.schema.json").read_text(encoding="utf-8"))
QUICK = ("--onset", "1", "--decoys", "30")
PNG = b"\x89PNG\r\n"


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """Keys, and motion capture of two robots that sent 13, and of two that sent nothing."""
    path = tmp_path_factory.mktemp("audit")
    save_key(KEY, path / "robot.key")
    save_key(key_of(KEY.scheme, OTHER_SECRET), path / "other.key")
    for name, symbols in (("sent", (3, 1)), ("silent", (None, None))):
        (path / name).mkdir()
        for number, symbol in enumerate(symbols):
            own = None if symbol is None else (symbol,)
            track = robot_track(KEY, f"robot{number}", own, 10.0, onset_s=1.0, seed=number)
            track = replace(track, headings_rad=np.zeros(len(track.times_s)))
            write_tum(track, path / name / f"robot{number}.tum")
    return path


@pytest.fixture
def audit(folder, capsys):
    """Run `mtm-audit decode` with the key; gives the exit code, standard output and standard error.

    With the paper's detector unless told otherwise: it is the quicker one, and the command is what is tested here.
    """

    def run(*arguments, key="robot.key", detector="coherency"):
        chosen = [] if detector is None else ["--detector", detector]
        with pytest.raises(SystemExit) as left:
            main(["decode", *map(str, arguments), "--key", str(folder / key), *chosen])
        out, err = capsys.readouterr()
        assert "Traceback" not in out + err
        assert FAKE_SECRET.hex() not in out + err
        return left.value.code or 0, out, err

    return run


def refused(answer, words, code=1):
    """One sentence on standard error, nothing on standard output, and the exit code."""
    assert answer[:2] == (code, "")
    err = answer[2]
    assert err.startswith("mtm-audit: ")
    assert err.count("\n") == 1
    assert words in err


def test_without_a_word_about_it_the_matched_detector_decodes(audit, folder):
    code, out, _ = audit(folder / "sent", detector=None)
    assert code == 0
    assert "bits for a message of this key, 13.3 are needed" in out
    assert out.splitlines()[1].startswith("Wrong at most once in 10,000, for any robot, camera and interference")
    head = next(line.split() for line in out.splitlines() if line.startswith("channel"))
    assert [head[head.index("symbol") + place] for place in (1, 2)] == ["bits", "needed"]
    rows = [line.split() for line in out.splitlines() if line.startswith("robot")]
    assert all(float(row[6]) >= float(row[7]) == 15.9 for row in rows)


def test_a_decode_says_the_message_first_and_then_why(audit, folder):
    code, out, err = audit(folder / "sent", *QUICK)
    assert (code, err) == (0, "")
    assert out.splitlines()[0] == "decoded: message 13 (0b1101)"
    assert "without a message of this key would look like this" in out
    assert KEY.scheme.fingerprint in out
    rows = [line.split() for line in out.splitlines() if line.startswith("robot")]
    assert [(row[0], row[1], row[2], row[3], row[5]) for row in rows] == [
        ("robot0", "robot0", "1.00", "50.00", "3"),
        ("robot1", "robot1", "1.00", "50.00", "1"),
    ]


def test_files_may_be_named_one_by_one(audit, folder):
    code, out, _ = audit(folder / "sent/robot1.tum", folder / "sent/robot0.tum", *QUICK)
    assert (code, out.splitlines()[0]) == (0, "decoded: message 13 (0b1101)")


def test_the_beginning_is_searched_for_unless_given(audit, folder):
    code, out, _ = audit(folder / "sent", "--json")
    assert code == 0
    assert json.loads(out)["channels"][0]["onset_s"] == pytest.approx(1.0, abs=0.4)


@pytest.mark.parametrize(("name", "key"), [("silent", "robot.key"), ("sent", "other.key")])
def test_absent_shows_no_symbol_that_looks_like_a_message(audit, folder, name, key):
    code, out, _ = audit(folder / name, *QUICK, key=key)
    assert code == 3
    assert out.startswith("absent: no message of key fake was found")
    assert "symbol" not in out
    assert "decoded" not in out


def test_a_missing_robot_is_named_with_what_would_help(audit, folder):
    code, out, _ = audit(folder / "sent/robot0.tum", *QUICK)
    assert code == 4
    assert out.startswith("inconclusive:")
    assert "not seen: symbol 1, the part of robot1" in out
    assert "warning: no track shows robot1" in out


def test_json_fits_the_schema_whatever_the_verdict(audit, folder):
    for code, path in ((0, "sent"), (3, "silent"), (4, "sent/robot0.tum")):
        got, out, _ = audit(folder / path, *QUICK, "--json")
        answer = json.loads(out)
        assert got == code
        jsonschema.Draft202012Validator(SCHEMA).validate(answer)
        assert answer["verdict"] == {0: "decoded", 3: "absent", 4: "inconclusive"}[code]
        assert (answer["message"], answer["message_bits"]) == ((13, "0b1101") if code == 0 else (None, None))
        assert [entry["symbol"] for entry in answer["symbols"]] == {0: [3, 1], 3: [], 4: [3, None]}[code]
        assert answer["decoys"]["count"] == 30
        assert answer["recording"]["frames"] == 1001


def test_tracks_without_names_are_matched_and_that_is_said(audit, folder, tmp_path):
    for source, name in (("robot0", "left"), ("robot1", "right")):
        (tmp_path / f"{name}.tum").write_bytes((folder / f"sent/{source}.tum").read_bytes())
    code, out, _ = audit(tmp_path, *QUICK)
    assert (code, out.splitlines()[0]) == (0, "decoded: message 13 (0b1101)")
    assert "Tracks matched by search among 2 tracks" in out
    assert "robot0 is left, robot1 is right" in out
    _, out, _ = audit(tmp_path, *QUICK, "--explain")
    assert "robot0 from track left, found by search" in out
    _, out, _ = audit(tmp_path, *QUICK, "--json")
    assert [(item["track"], item["track_searched"]) for item in json.loads(out)["channels"]] == [
        ("left", True), ("right", True)
    ]  # fmt: skip
    jsonschema.validate(json.loads(out), SCHEMA)
    code, out, _ = audit(tmp_path, *QUICK, key="other.key")
    assert code == 3
    assert "without a message the pairs are chance" in out
    assert "robot0 is" not in out


def test_evidence_is_said_in_bits(audit, folder):
    _, out, _ = audit(folder / "sent", *QUICK)
    _, text, _ = audit(folder / "sent", *QUICK, "--json")
    bits = json.loads(text)["evidence_bits"]
    assert bits > 13.0
    assert f"evidence   {bits:.1f} bits of evidence for a message of this key (-log2 p)" in out


def test_the_schema_is_one_and_would_notice(audit, folder):
    jsonschema.Draft202012Validator.check_schema(SCHEMA)
    answer = json.loads(audit(folder / "sent", *QUICK, "--json")[1])
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(answer | {"message": None}, SCHEMA)
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate({name: answer[name] for name in answer if name != "p_value"}, SCHEMA)


def test_the_documented_fields_are_those_of_the_schema():
    text = (ROOT / "docs/decode-json.md").read_text(encoding="utf-8")
    for name in [*SCHEMA["properties"], *SCHEMA["properties"]["channels"]["items"]["properties"]]:
        assert f"`{name}`" in text, f"docs/decode-json.md does not describe {name}"


def test_an_explanation_goes_through_all_stages(audit, folder):
    code, out, _ = audit(folder / "sent", *QUICK, "--explain")
    assert code == 0
    heads = [line.split()[0] for line in out.partition("\n\n")[0].splitlines() if not line.startswith(" ")]
    assert heads == ["key", "recording", "tracks", "glimpse", "timing", "detector", "symbols", "message", "verdict"]
    assert "FAILED" not in out


def test_an_explanation_says_where_it_failed(audit, folder):
    _, out, _ = audit(folder / "silent", *QUICK, "--explain")
    assert "verdict    FAILED: absent" in out
    _, out, _ = audit(folder / "sent/robot0.tum", *QUICK, "--explain")
    assert "symbols    FAILED: 1 of 2 are not certain" in out
    assert "try: record longer" in out


def test_an_explanation_stops_where_an_error_stopped_it(audit, folder):
    code, out, err = audit(folder / "sent", "--onset", "5", "--explain")
    assert (code, out) == (1, "")
    assert "tracks     robot0: seen in 1001 of 1001 samples" in err
    assert "timing     FAILED: the recording of 'robot0' holds no whole window of 8 s" in err
    code, out, err = audit(folder / "sent/robot0.tum", folder / "nothing.tum", "--explain")
    assert "recording  FAILED: cannot read the recording" in err
    code, out, err = audit(folder / "sent", "--assign", "robot0=red", "--explain")
    assert "tracks     FAILED: the recording has no track 'red'" in err


def test_an_explanation_stays_out_of_the_json(audit, folder):
    _, out, err = audit(folder / "sent", *QUICK, "--explain", "--json")
    assert json.loads(out)["message"] == 13
    assert "timing" in err


@pytest.mark.parametrize(("name", "code"), [("sent", 0), ("silent", 3), ("sent/robot0.tum", 4)])
def test_a_decode_is_drawn(audit, folder, tmp_path, name, code):
    picture = tmp_path / "decode.png"
    assert audit(folder / name, *QUICK, "--plot", picture)[0] == code
    assert picture.read_bytes().startswith(PNG)
    assert list(tmp_path.iterdir()) == [picture]


def test_an_unwritable_picture_is_refused_before_the_work(audit, folder, tmp_path, monkeypatch):
    monkeypatch.setattr("mtm_audit.decoding.recorded.decode_tracks", lambda *_: pytest.fail("worked first"))
    refused(audit(folder / "sent", "--plot", tmp_path / "decode.bmp"), "end the name in .png, .pdf, .svg", code=2)
    refused(audit(folder / "sent", "--plot", tmp_path / "nowhere/decode.png"), "choose a folder that exists")
    (tmp_path / "folder.png").mkdir()
    refused(audit(folder / "sent", "--plot", tmp_path / "folder.png"), "is a folder")


def test_a_drawing_that_breaks_off_leaves_the_former_picture(audit, folder, tmp_path, monkeypatch):
    def interrupted(*_args, **_kwargs):
        raise KeyboardInterrupt

    picture = tmp_path / "decode.png"
    picture.write_bytes(PNG + b"\x1a\nmade by mtm-audit decode: the former one")
    former = picture.read_bytes()
    monkeypatch.setattr("matplotlib.figure.Figure.savefig", interrupted)
    code, out, _ = audit(folder / "sent", *QUICK, "--plot", picture, "--json")
    assert (code, out) == (130, "")
    assert [(path.name, path.read_bytes()) for path in tmp_path.iterdir()] == [("decode.png", former)]


def test_an_interrupt_ends_with_130_and_no_answer(audit, folder, monkeypatch):
    def interrupted(*_args, **_kwargs):
        raise KeyboardInterrupt

    monkeypatch.setattr("mtm_audit.decoding.recorded.decode_tracks", interrupted)
    code, out, err = audit(folder / "sent", "--json")
    assert (code, out) == (130, "")
    assert "interrupted" in err


def run_program(*arguments, **options):
    command = [sys.executable, "-c", "from mtm_audit.cli import main; main()", *map(str, arguments)]
    # Programs in the background inherit that interrupts are ignored, and these are to be interrupted.
    heed = lambda: signal.signal(signal.SIGINT, signal.SIG_DFL)  # noqa: E731
    return subprocess.Popen(
        command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, preexec_fn=heed, **options
    )


def test_control_c_during_the_work_leaves_nothing_half_done(folder, tmp_path):
    busy = run_program(
        "decode", folder / "sent", "--key", folder / "robot.key", "--json", "--detector",
        "coherency", "--decoys", "10000", "--plot", tmp_path / "decode.png",
    )  # fmt: skip
    # Loading takes a moment; what comes before it must end well, too, so the exact instant does not matter.
    time.sleep(1.5)
    busy.send_signal(signal.SIGINT)
    out, _ = busy.communicate(timeout=PATIENCE_S)
    assert busy.returncode in (130, -signal.SIGINT)
    assert out == ""
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("name", "content", "words"),
    [
        ("missing.tum", None, "No such file"),
        ("empty.tum", b"", "is empty"),
        ("empty.mp4", b"", "is empty"),
        ("text.mp4", b"this is no video", "is not a video that can be read"),
        ("zeros.bin", bytes(5000), "is not a video that can be read"),
        ("unsorted.csv", b"time,x,y\n0,0,0\n2,0,0\n1,0,0\n", "line 4: time 1.000000 s does not come after"),
        ("words.csv", b"time,x,y\n0,zero,0\n", "line 2: expected 3 numbers"),
        ("other.csv", b"t,a,b\n0,0,0\n", "the header lacks the column 'x'"),
        ("short.tum", b"0 0 0 0 0 0 0\n", "line 1: expected 8 numbers"),
        ("brief.csv", b"time,x,y\n0,0,0\n", "at least 3 are needed"),
    ],
)
def test_a_recording_that_is_none_is_refused_in_one_sentence(audit, tmp_path, name, content, words):
    if content is not None:
        (tmp_path / name).write_bytes(content)
    refused(audit(tmp_path / name, "--assign", "robot0=brief"), words)


def test_a_folder_without_recordings_is_refused(audit, tmp_path):
    refused(audit(tmp_path), "holds no video, no pictures and no log")


def test_two_files_of_one_body_are_refused(audit, folder):
    refused(audit(folder / "sent", folder / "silent/robot0.tum"), "two files are of the body 'robot0'")


@pytest.fixture
def video(tmp_path):
    """A video without a robot."""
    gray = np.full((96, 128, 3), 128, dtype=np.uint8)
    write_video([Frame(number / 30, gray) for number in range(20)], tmp_path / "empty_room.mp4")
    return tmp_path / "empty_room.mp4"


def test_a_video_without_a_robot_is_refused(audit, video):
    refused(audit(video), "no marker found in 20 frames")
    refused(audit(video, "--tracker", "colour:red"), "none of red found in 20 frames")


def test_an_explained_video_says_that_nothing_was_found(audit, video):
    code, out, err = audit(video, "--explain")
    assert (code, out) == (1, "")
    assert f"recording  video {video}, 20 frames" in err
    assert "tracks     FAILED: no marker found in 20 frames" in err


def test_a_video_comes_alone(audit, video, folder):
    refused(audit(video, folder / "sent"), "decode them one by one")


def test_a_truncated_video_is_refused(audit, video):
    video.write_bytes(video.read_bytes()[:200])
    refused(audit(video), "holds no video stream")


def test_names_that_do_not_exist_are_refused_with_those_that_do(audit, folder):
    refused(audit(folder / "sent", "--tracker", "eyes"), "choose one of: aruco", code=2)
    refused(audit(folder / "sent", detector="guessing"), "choose one of: coherency", code=2)
    refused(audit(folder / "sent", "--assign", "arm=robot0"), "its bodies are: robot0, robot1")


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda text: text[:40], "is not valid TOML"),
        (lambda text: text.replace("version = 1", "version = 9"), "the scheme is of version 9"),
        (lambda text: text.replace("secret", "secrets"), "unknown field 'secrets'"),
        (lambda text: text.replace(FAKE_SECRET.hex(), "00ff"), "64 hexadecimal digits"),
    ],
)
def test_a_malformed_key_is_refused_without_showing_it(audit, folder, tmp_path, change, words):
    path = tmp_path / "bad.key"
    path.write_text(change((folder / "robot.key").read_text(encoding="utf-8")), encoding="utf-8")
    path.chmod(0o600)
    refused(audit(folder / "sent", key=path), words)


def test_a_key_that_others_can_read_is_refused(audit, folder, tmp_path):
    path = tmp_path / "open.key"
    path.write_bytes((folder / "robot.key").read_bytes())
    path.chmod(0o644)
    refused(audit(folder / "sent", key=path), "can be read by others (mode 0644); run: chmod 600")


@pytest.mark.parametrize(
    "arguments",
    [
        ("--onset", "soon"), ("--onset", "nan"), ("--onset", "inf"), ("--assign", "robot0"), ("--assign", "=red"),
        ("--assign", "robot0="), ("--assign", "robot0=a", "--assign", "robot0=b"), ("--decoys", "3"),
        ("--decoys", "10001"),
        ("--threshold", "2"), ("--nothing",),
    ],
)  # fmt: skip
def test_a_wrong_use_ends_with_2(audit, folder, arguments):
    code, out, err = audit(folder / "sent", *arguments)
    assert (code, out) == (2, "")
    assert "Error" in err


def test_gaps_and_nan_in_motion_capture_are_missing_data(audit, folder, tmp_path):
    for number in range(2):
        lines = (folder / f"sent/robot{number}.tum").read_text(encoding="utf-8").splitlines()
        lines[300] = f"{lines[300].split()[0]} nan nan nan 0 0 0 1"
        kept = [line for row, line in enumerate(lines) if not 500 <= row < 560]
        (tmp_path / f"robot{number}.tum").write_text("\n".join(kept), encoding="utf-8")
    code, out, _ = audit(tmp_path, *QUICK)
    assert (code, out.splitlines()[0]) == (0, "decoded: message 13 (0b1101)")


def test_a_recording_too_short_for_a_window_is_refused(audit, folder, tmp_path):
    for number in range(2):
        lines = (folder / f"sent/robot{number}.tum").read_text(encoding="utf-8").splitlines()
        (tmp_path / f"robot{number}.tum").write_text("\n".join(lines[:300]), encoding="utf-8")
    refused(audit(tmp_path), "holds no whole window of 8 s")


def test_the_command_line_s_defaults_are_the_decoder_s():
    asked, settings = inspect.signature(decode).parameters, DecodeSettings()
    for name in ("detector", "decoys", "threshold"):
        assert asked[name].default == getattr(settings, name)
    assert (asked["onset"].default, settings.onset_s) == ("auto", None)


def test_help_loads_nothing_heavy_and_names_the_exit_codes():
    script = (
        "import sys\nfrom mtm_audit.cli import main\n"
        "try:\n    main(sys.argv[1:])\nexcept SystemExit as left:\n    code = left.code\n"
        "heavy = {'cv2', 'scipy', 'matplotlib', 'numpy', 'av', 'filterpy'} & sys.modules.keys()\n"
        "assert not heavy and not code, (heavy, code)\n"
    )
    for arguments in (["--help"], ["decode", "--help"], ["--version"]):
        done = subprocess.run(
            [sys.executable, "-W", "error", "-c", script, *arguments], capture_output=True, text=True, check=False,
            env=os.environ | {"COLUMNS": "200"},
        )  # fmt: skip
        assert (done.returncode, done.stderr) == (0, "")
        if arguments == ["decode", "--help"]:
            codes = "0 decoded, 3 no message of this key, 4 inconclusive, 1 error, 2 usage, 130 interrupted"
            assert codes in " ".join(done.stdout.split())
        if arguments == ["--version"]:
            assert done.stdout.startswith("mtm-audit ")


def test_small_products_are_left_to_one_thread(monkeypatch):
    monkeypatch.delenv("OPENBLAS_NUM_THREADS", raising=False)
    with pytest.raises(SystemExit):
        main(["--version"])
    assert os.environ["OPENBLAS_NUM_THREADS"] == "1"


def test_options_of_logs_reach_the_reader(audit, tmp_path):
    lines = ["t,x,y", *(f"{10 * index},{index},0" for index in range(1000))]
    (tmp_path / "robot0.csv").write_text("\n".join(lines))
    code, out, _ = audit(tmp_path, "--unit", "mm", "--time-unit", "ms", "--onset", "0", "--json")
    assert code in (0, 3, 4)
    assert json.loads(out)["recording"]["duration_s"] == pytest.approx(9.99)


@pytest.mark.parametrize(
    ("option", "value", "words"),
    [
        ("--unit", "parsec", "'parsec' is no unit of length; give one of m, dm, cm"),
        ("--time-unit", "days", "'days' is no unit of time; give one of s, ms"),
        ("--up", "w", "'w' is no axis; give one of x, y, z"),
        ("--heading-axis", "+x", "'+x' is no axis of a body; give one of x, y, z, -x, -y, -z"),
        ("--body", "rover", "'rover' is not NAME=MARKER,MARKER"),
    ],
)
def test_options_of_logs_that_mean_nothing_are_refused(audit, folder, option, value, words):
    refused(audit(folder / "sent", option, value), words, code=2)


def test_a_calibration_that_does_not_fit_is_told(audit, folder, tmp_path):
    calibration = tmp_path / "cam0.yaml"
    refused(audit(folder / "sent", "--camera", calibration), f"cannot read the calibration {calibration}")
    calibration.write_text(camera_info())
    code, out, _ = audit(folder / "sent", "--camera", calibration, "--json")
    assert code == 0
    assert "--camera was not used: the recording is motion capture or a log, and no film" in json.loads(out)["warnings"]
    path = film(tmp_path / "film.mp4", [(marker(), (100, 100), True)], seconds=0.5)
    words = f"{calibration} is of pictures of 752 x 480, and the film's are of {SIZE[0]} x {SIZE[1]}"
    refused(audit(path, "--camera", calibration), words)
    refused(audit(path, "--camera", calibration, "--tracker", "brightness"), "what no lens showed; leave out --camera")


def test_a_topic_is_chosen_on_the_command_line(audit, tmp_path):
    bag = write_rosbag2(tmp_path, driving("robot0", 10.0), driving("robot1", 10.0))
    refused(audit(bag, "--topic", "/scan"), "has no /scan; it has: /robot0/odom, /robot1/odom")
    code, out, _ = audit(bag, "--topic", "/robot1/odom", "--onset", "0", "--json")
    assert code in (3, 4)
    assert json.loads(out)["recording"]["duration_s"] == pytest.approx(10.0)


def test_a_file_left_out_of_a_folder_is_told(audit, folder, tmp_path):
    shutil.copytree(folder / "sent", tmp_path / "sent")
    (tmp_path / "sent" / "prices.csv").write_text("day,price\n1,2\n")
    _, out, _ = audit(tmp_path / "sent", "--onset", "1", "--json")
    assert ["prices.csv is of no format that is read" in warning for warning in json.loads(out)["warnings"]].count(
        True
    ) == 1


@pytest.mark.parametrize(("name", "code"), [("sent", 0), ("silent", 3), ("sent/robot0.tum", 4)])
def test_a_report_is_written_beside_the_answer(audit, folder, tmp_path, name, code):
    page = tmp_path / "report.html"
    found, out, _ = audit(folder / name, *QUICK, "--report", page, "--json")
    text = page.read_text(encoding="utf-8")
    assert (found, list(tmp_path.iterdir())) == (code, [page])
    assert {0: "decoded: message 13", 3: "absent: no message", 4: "inconclusive: a message"}[code] in text
    assert json.loads(out)["verdict"] in text
    assert f"mtm-audit decode {folder / name} --onset 1 --decoys 30 --report {page} --json --key" in text
    assert hashlib.sha256((folder / "robot.key").read_bytes()).hexdigest() in text
    assert FAKE_SECRET.hex() not in text


def test_a_report_replaces_reports_and_nothing_else(audit, folder, tmp_path):
    page = tmp_path / "report.html"
    page.write_text("<!DOCTYPE html><p>somebody's own page")
    refused(audit(folder / "sent", *QUICK, "--report", page), "was not made by mtm-audit decode")
    assert page.read_text() == "<!DOCTYPE html><p>somebody's own page"
    assert audit(folder / "sent", *QUICK, "--report", page, "--force")[0] == 0
    assert audit(folder / "silent", *QUICK, "--report", page)[0] == 3
    assert "absent: no message" in page.read_text(encoding="utf-8")


def test_a_report_never_takes_the_place_of_a_key(audit, folder, tmp_path):
    key = tmp_path / "key.html"
    shutil.copy(folder / "robot.key", key)
    refused(audit(folder / "sent", *QUICK, "--report", key, "--force"), "is a key file")
    assert key.read_bytes() == (folder / "robot.key").read_bytes()


def test_a_report_is_refused_before_the_work(audit, folder, tmp_path, monkeypatch):
    monkeypatch.setattr("mtm_audit.decoding.recorded.decode_tracks", lambda *_: pytest.fail("worked first"))
    refused(audit(folder / "sent", "--report", tmp_path / "report.txt"), "end it in .html or .htm", code=2)
    refused(audit(folder / "sent", "--report", tmp_path / "nowhere/report.html"), "there is no folder")
    refused(audit(folder / "sent", "--report", tmp_path / "a.html", "--plot", tmp_path / "a.html"), "for two results")


def test_a_track_with_markup_in_its_name_is_printed_whole(audit, folder, tmp_path):
    for number in range(2):
        shutil.copy(folder / f"sent/robot{number}.tum", tmp_path / f"body[left]{number}.tum")
    _, out, _ = audit(tmp_path, *QUICK)
    assert "robot0  body[left]0" in out


def test_an_absent_message_s_explanation_names_no_best_symbol(audit, folder):
    code, out, _ = audit(folder / "silent", *QUICK, "--explain")
    assert code == 3
    assert "ahead of the next" not in out
    assert "the message begins" not in out
