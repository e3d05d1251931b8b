"""The commands that make keys with a framing and that ask a running robot."""

import json

import pytest

from mtm_onboard.cli import main
from mtm_onboard.control.control_socket import ControlSocket
from mtm_onboard.protocol import MtmError, load_key
from mtm_onboard.protocol.framing import Framing

FRAMED = (
    "--preset", "paper-robomaster-fleet", "--message-ticks", "6000", "--channel", "robot0:vx,vy:40:0.1",
    "--channel", "robot1:vx,vy:40:0.1", "--payload", "text:8", "--check", "tag:32", "--code", "reed-solomon",
    "--number-bits", "4", "--interleave", "--schedule", "rolling", "--epoch", "3", "--pooling", "majority",
)  # fmt: skip
CONFIG = """
[robot]
name = "robot0"
channel = "robot1"
[transport]
kind = "none"
[limits]
speed_mps = 1.0
turn_rate_radps = 2.0
[source]
kind = "stdin"
"""
STATUS = {
    "robot": "r0", "state": "driving", "late_p99_ms": 0.5, "message": 2, "content": "number 7",
    "commands": {"age_s": None}, "tick": 9, "missed": 0, "unsent": 1,
    "link": {"up": True, "fault": None, "heartbeats": 3},
}  # fmt: skip


def keygen(folder, *options) -> int:
    return main(["keygen", "--id", "fake-key", "--out", str(folder / "robot.key"), *options])


@pytest.fixture
def config(tmp_path):
    path = tmp_path / "robot.toml"
    path.write_text(CONFIG + f'[control]\nsocket = "{tmp_path / "r.sock"}"\n')
    return path


def test_keygen_provisions_a_framing_and_the_schedule_s_options(tmp_path):
    assert keygen(tmp_path, *FRAMED) == 0
    scheme = load_key(tmp_path / "robot.key").scheme
    assert scheme.framing == Framing(
        "text", 64, number_bits=4, check="tag", check_bits=32, code="reed-solomon", interleave=True
    )
    assert (scheme.schedule, scheme.epoch, scheme.pooling) == ("rolling", 3, "majority")


def test_without_framing_options_a_message_is_a_plain_number(tmp_path):
    assert keygen(tmp_path, "--preset", "paper-robomaster-fleet") == 0
    assert load_key(tmp_path / "robot.key").scheme.framing is None


def test_new_keys_are_masters_rolling_and_tagged(tmp_path, capsys):
    assert keygen(tmp_path, "--preset", "robomaster-fleet", "--first-day", "2026-11-30", "--days", "7") == 0
    key = load_key(tmp_path / "robot.key")
    grant = key.holding.grant
    assert (grant.kind, str(grant.first_day), str(grant.last_day)) == ("master", "2026-11-30", "2026-12-06")
    assert (key.scheme.schedule, key.scheme.framing.check, key.scheme.message_ticks) == ("rolling", "tag", 600)
    assert "keep it secret and apart" in capsys.readouterr().out


PLAIN = ("--name", "x", "--rate", "50", "--band", "0.5:5", "--alphabet", "16")


@pytest.mark.parametrize(
    ("options", "framing"),
    [
        (("--channel", "a:vx:10:0.1"), Framing("integer", 8, check="tag", check_bits=32)),
        (("--channel", "a:vx:8:0.1"), Framing("integer", 8, check="tag", check_bits=24)),
        (("--channel", "a:vx:5:0.1"), Framing("integer", 4, check="tag", check_bits=16)),
        (("--channel", "a:vx:10:0.1", "--payload", "integer:20"), Framing("integer", 20, check="tag", check_bits=16)),
        (("--channel", "a:vx:10:0.1", "--check", "none"), None),
        (("--channel", "a:vx:10:0.1", "--schedule", "fixed"), None),
    ],
)
def test_the_widest_tag_that_fits_is_taken(tmp_path, options, framing):
    ticks = "3000" if "a:vx:8:0.1" not in options else "3200"
    assert keygen(tmp_path, *PLAIN, "--message-ticks", ticks, *options) == 0
    assert load_key(tmp_path / "robot.key").scheme.framing == framing


def test_a_message_without_room_for_a_tag_says_so(tmp_path, capsys):
    assert keygen(tmp_path, *PLAIN, "--message-ticks", "600", "--channel", "a:vx:4:0.1") == 2
    assert "there is no room for a tag" in capsys.readouterr().err
    assert not (tmp_path / "robot.key").exists()


def test_files_are_issued_disclosed_and_revoked(tmp_path, capsys):
    assert keygen(tmp_path, "--preset", "robomaster-fleet", "--first-day", "2026-01-01", "--days", "400") == 0
    master = ["--master", str(tmp_path / "robot.key")]
    span = ["--first-day", "2026-01-05", "--days", "2"]
    assert main(["issue", *master, "--channel", "robot1", *span, "--out", str(tmp_path / "r1.key"),
                 "--not-after", "2026-01-06T12:00:00"]) == 0  # fmt: skip
    assert main(["issue", *master, "--auditor", *span, "--out", str(tmp_path / "a.key")]) == 0
    assert main(["anchor", *master, "--out", str(tmp_path / "fleet.anchor")]) == 0
    capsys.readouterr()
    assert main(["show", "--key", str(tmp_path / "r1.key")]) == 0
    shown = capsys.readouterr().out
    for fact in ("robot, serial ", "play robot1, and make the fleet's tags", "2026-01-05 to 2026-01-06 in UTC (2)",
                 "not after     2026-01-06 12:00:00 UTC"):  # fmt: skip
        assert fact in shown
    grant = load_key(tmp_path / "a.key").holding.grant
    assert (grant.kind, grant.channels) == ("auditor", ("robot0", "robot1", "robot2", "robot3"))
    disclose = ["disclose", *master, "--out", str(tmp_path / "day.key"), "--allow-unsynchronised", "--day"]
    assert main([*disclose, "2126-01-05"]) == 1
    assert "not to be disclosed before 2126-01-06 01:00" in capsys.readouterr().err
    assert not (tmp_path / "day.key").exists()


@pytest.mark.parametrize(
    ("options", "says"),
    [
        (("--channel", "robot9"), "no channel 'robot9'"),
        (("--channel", "robot1", "--first-day", "2020-01-01"), "this master is for"),
        (("--auditor", "--days", "0"), "give them in order"),
        (("--auditor", "--days", "99999999"), "after the year 9999"),
        (("--auditor", "--first-day", "1950-01-01"), "before 1970"),
    ],
)
def test_a_file_that_cannot_be_issued_is_refused(tmp_path, capsys, options, says):
    assert keygen(tmp_path, "--preset", "robomaster-fleet") == 0
    assert main(["issue", "--master", str(tmp_path / "robot.key"), *options, "--out", str(tmp_path / "a.key")]) == 1
    assert says in capsys.readouterr().err
    assert not (tmp_path / "a.key").exists()


def test_only_a_master_issues(tmp_path, capsys):
    assert keygen(tmp_path, "--preset", "paper-robomaster-fleet") == 0
    assert main(["issue", "--master", str(tmp_path / "robot.key"), "--auditor", "--out", str(tmp_path / "a.key")]) == 1
    assert "is no master but of format 1" in capsys.readouterr().err


def test_a_revoked_or_expired_robot_does_not_run(tmp_path, config, capsys):
    assert keygen(tmp_path, "--preset", "robomaster-fleet", "--first-day", "2026-01-01", "--days", "36500") == 0
    issue = ["issue", "--master", str(tmp_path / "robot.key"), "--channel", "robot1", "--out"]
    assert main([*issue, str(tmp_path / "old.key"), "--first-day", "2026-01-01", "--days", "1"]) == 0
    assert main([*issue, str(tmp_path / "r1.key"), "--not-after", "2026-01-02T00:00:00Z"]) == 0
    assert main([*issue, str(tmp_path / "stolen.key")]) == 0
    serial = load_key(tmp_path / "stolen.key").holding.grant.serial
    revoked = str(tmp_path / "fleet.revoked")
    assert main(["revoke", "--list", revoked, "--serial", serial, "--channel", "robot1"]) == 0
    run = ["run", "--config", str(config), "--message", "5", "--allow-unsynchronised", "--revoked", revoked, "--key"]
    for name, says in (
        ("old", "is for days up to 2026-01-01"),
        ("r1", "expired on 2026-01-02"),
        ("stolen", "was revoked"),
    ):
        capsys.readouterr()
        assert main([*run, str(tmp_path / f"{name}.key")]) == 1
        assert says in capsys.readouterr().err


def test_an_integer_s_size_is_in_bits(tmp_path):
    assert keygen(tmp_path, "--preset", "paper-robomaster-fleet", "--payload", "integer:5") == 0
    assert load_key(tmp_path / "robot.key").scheme.framing == Framing("integer", 5)


@pytest.mark.parametrize(
    ("options", "code", "says"),
    [
        (("--check", "tag:32"), 2, "needs --payload"),
        (("--interleave",), 2, "needs --payload"),
        (("--payload", "text"), 2, "--payload"),
        (("--payload", "song:3"), 2, "choose one of"),
        (("--payload", "text:3"), 2, "symbols would hold them"),
        (("--pooling", "guess"), 2, "pooling"),
    ],
)
def test_a_framing_that_cannot_be_writes_no_key(tmp_path, capsys, options, code, says):
    try:
        ended = keygen(tmp_path, "--preset", "paper-robomaster-fleet", *options)
    except SystemExit as leaving:
        ended = leaving.code
    assert ended == code
    assert says in capsys.readouterr().err
    assert not (tmp_path / "robot.key").exists()


def test_show_says_in_words_what_a_frame_holds(tmp_path, capsys):
    keygen(tmp_path, *FRAMED)
    capsys.readouterr()
    main(["show", "--key", str(tmp_path / "robot.key")])
    shown = capsys.readouterr().out
    for fact in ("120 s, 80 symbols", "up to 8 bytes of text: 64 bits, 0.533 bits/s", "modulo 16", "tag of 32 bits",
                 "GF(2^6), 8 of 26 code symbols parity", "4 wrong or 8 missing", ", interleaved"):  # fmt: skip
        assert fact in shown
    assert load_key(tmp_path / "robot.key").secret.master.hex() not in shown


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (("--message", "5"), "text, not a number"),
        (("--text", "much too long"), "1 to 8 bytes"),
        (("--hex", "00f"), "two hexadecimal digits"),
        (("--symbols", "1,2"), "symbols cannot be given"),
    ],
)
def test_run_refuses_a_payload_that_the_key_does_not_carry(tmp_path, config, capsys, content, says):
    keygen(tmp_path, *FRAMED)
    assert main(["run", "--config", str(config), "--key", str(tmp_path / "robot.key"), *content]) == (
        2 if "--hex" in content else 1
    )
    error = capsys.readouterr().err
    assert says in error
    assert error.count("\n") == 1


@pytest.fixture
def robot(tmp_path):
    """A control socket that answers like a robot; yields what it was asked."""
    asked = []

    def answer(request):
        asked.append(request)
        if request["command"] == "send":
            if request["content"] == {"number": 999}:
                raise MtmError("the message 999 does not fit; give a smaller one")
            slot = 7 if "text" in request["content"] else None
            replaces = 1 if "hex" in request["content"] else None
            return {
                "tick": 120,
                "unix_s": 1_800_000_000.25,
                "slot": slot,
                "number": 2,
                "content": "number 7",
                "replaces": replaces,
            }
        if request["command"] == "silence":
            return {"tick": 120, "unix_s": 1_800_000_000.25, "slot": 7, "replaces": "silence"}
        if request["command"] == "status":
            return dict(STATUS)
        return {"stopped": True}

    with ControlSocket(tmp_path / "r.sock") as control:
        control.serve(answer)
        yield asked


@pytest.mark.parametrize(
    ("content", "request_", "says"),
    [
        (
            ("--message", "7"),
            {"number": 7},
            "message 2, number 7, begins at 2027-01-15 08:00:00.250000 UTC (1800000000.250000)\n",
        ),
        (("--text", "-hi"), {"text": "-hi"}, "UTC (1800000000.250000), slot 7\n"),
        (("--hex", "00ff"), {"hex": "00ff"}, "in the place of message 1 that was waiting\n"),
        (("--symbols", "1,2"), {"symbols": [1, 2]}, "message 2, "),
    ],
)
def test_send_asks_for_the_message_and_says_when_it_begins(config, robot, capsys, content, request_, says):
    assert main(["send", "--config", str(config), "=".join(content)]) == 0
    assert robot == [{"command": "send", "content": request_}]
    assert says in capsys.readouterr().out


def test_send_asks_for_silence_and_says_when_it_begins(config, robot, capsys):
    assert main(["send", "--config", str(config), "--silence"]) == 0
    assert robot == [{"command": "silence"}]
    assert capsys.readouterr().out == (
        "silence begins at 2027-01-15 08:00:00.250000 UTC (1800000000.250000), slot 7, "
        "in the place of silence that was waiting\n"
    )


def test_silence_is_no_content_beside_another(config, robot):
    with pytest.raises(SystemExit):
        main(["send", "--config", str(config), "--silence", "--message", "7"])
    assert robot == []


def test_send_says_the_robot_s_sentence_when_it_refuses(config, robot, capsys):
    assert main(["send", "--config", str(config), "--message", "999"]) == 1
    assert capsys.readouterr().err == "mtm-onboard: the message 999 does not fit; give a smaller one\n"


def test_status_and_stop_ask_the_socket_that_is_named(tmp_path, robot, capsys):
    path = str(tmp_path / "r.sock")
    assert main(["status", "--socket", path]) == 0
    shown = capsys.readouterr().out.splitlines()
    assert [line.split() for line in shown] == [
        ["robot", "r0"], ["state", "driving"], ["late", "p99", "ms", "0.5"], ["message", "2"],
        ["content", "number", "7"], ["commands", "age", "s", "none"], ["tick", "9"], ["missed", "0"], ["unsent", "1"],
        ["link", "up", "True"], ["link", "fault", "none"], ["link", "heartbeats", "3"],
    ]  # fmt: skip
    assert main(["stop", "--socket", path]) == 0
    assert "stands still" in capsys.readouterr().out
    assert robot == [{"command": "status"}, {"command": "stop"}]


def test_a_robot_that_does_not_run_gets_one_sentence(tmp_path, config, capsys):
    assert main(["stop", "--config", str(config)]) == 1
    assert "no running robot answers" in capsys.readouterr().err
    config.write_text(CONFIG)
    assert main(["stop", "--config", str(config)]) == 1
    assert "no control socket" in capsys.readouterr().err


def test_status_is_json_when_asked_for(config, robot, capsys):
    assert main(["status", "--config", str(config), "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == STATUS


def test_a_watched_status_is_a_line_each_time_until_an_interrupt(config, robot, capsys, monkeypatch):
    pauses = []

    def sleep(seconds: float) -> None:
        pauses.append(seconds)
        if len(pauses) == 3:
            raise KeyboardInterrupt

    monkeypatch.setattr("time.sleep", sleep)
    assert main(["status", "--config", str(config), "--watch"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert pauses == [1.0] * 3
    assert [line.split(maxsplit=1)[1] for line in lines] == [
        "driving; tick 9; message 2, number 7; no base command yet; link up; 0 missed, 1 unsent"
    ] * 3
    pauses.clear()
    assert main(["status", "--config", str(config), "--watch", "5", "--json"]) == 0
    assert [json.loads(line) for line in capsys.readouterr().out.splitlines()] == [STATUS] * 3


def test_a_robot_that_ends_while_it_is_watched_is_one_sentence(config, capsys, monkeypatch):
    with ControlSocket(config.parent / "r.sock") as control:
        control.serve(lambda request: dict(STATUS))
        monkeypatch.setattr("time.sleep", lambda seconds: control.close())
        assert main(["status", "--config", str(config), "--watch"]) == 1
    assert "no running robot answers" in capsys.readouterr().err


@pytest.mark.parametrize("period", ["0", "nan", "often"])
def test_a_period_that_is_none_is_wrong_usage(config, period):
    with pytest.raises(SystemExit) as left:
        main(["status", "--config", str(config), "--watch", period])
    assert left.value.code == 2


def test_keygen_shapes_the_spectrum_and_show_tells_it(tmp_path, capsys):
    shaped = ("--preset", "robomaster-fleet", "--spectrum", "0.5:3,2:3,5:-6.5")
    assert keygen(tmp_path, *shaped) == 0
    assert load_key(tmp_path / "robot.key").scheme.spectrum == ((0.5, 3.0), (2.0, 3.0), (5.0, -6.5))
    assert main(["show", "--key", str(tmp_path / "robot.key")]) == 0
    assert "spectrum      0 dB at 0.5 Hz, 0 dB at 2 Hz, -9.5 dB at 5 Hz\n" in capsys.readouterr().out


def test_a_flat_spectrum_is_none_at_all(tmp_path, capsys):
    assert keygen(tmp_path, "--preset", "robomaster-fleet", "--spectrum", "flat") == 0
    assert load_key(tmp_path / "robot.key").scheme.spectrum is None
    assert main(["show", "--key", str(tmp_path / "robot.key")]) == 0
    assert "spectrum      flat\n" in capsys.readouterr().out


@pytest.mark.parametrize("text", ["loud", "0.5", "0.5:0,5", "5:0,0.5:-6", "1:0", "1:0,2:nan", "1:0:0,2:0"])
def test_a_spectrum_that_cannot_be_is_a_usage_error(tmp_path, capsys, text):
    try:
        code = keygen(tmp_path, "--preset", "robomaster-fleet", "--spectrum", text)
    except SystemExit as ended:
        code = ended.code
    assert code == 2
    assert "spectrum" in capsys.readouterr().err
    assert not (tmp_path / "robot.key").exists()


@pytest.mark.parametrize(
    ("preset", "shown"),
    [
        ("fast", ("band          0.5 to 5 Hz", "alphabet      4096 symbols", "message       400 ticks, 8 s, 16 symbols",
                  "64 bits, 8 bits/s", "tag of 32 bits", "7 of 16 code symbols parity", "sigma 0.1")),
        ("quiet", ("band          0.5 to 2.5 Hz", "alphabet      256 symbols", "combine same", "tag of 24 bits",
                   "body robot0, axes vx, ", "sigma 0.02", "body robot0, axes wz, ", "sigma 0.1")),
    ],
)  # fmt: skip
def test_presets_are_whole_schemes_with_a_tag(tmp_path, capsys, preset, shown):
    assert keygen(tmp_path, "--preset", preset) == 0
    assert main(["show", "--key", str(tmp_path / "robot.key")]) == 0
    out = capsys.readouterr().out
    assert [fact for fact in shown if fact not in out] == []
    assert "schedule rolling" in out
