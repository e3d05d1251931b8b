"""`mtm-audit watch` as it is called."""

import os
import signal
import socket
import subprocess
import sys
import threading

import pytest

from mtm_audit.cli import main
from mtm_onboard.protocol import save_key
from tests.audit.live.watched import KEY, poses
from tests.audit.moving_robot import FAKE_SECRET, OTHER_SECRET, key_of
from tests.patience import PATIENCE_S


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    path = tmp_path_factory.mktemp("watch")
    save_key(KEY, path / "robot.key")
    save_key(key_of(KEY.scheme, OTHER_SECRET), path / "other.key")
    lines = [f"{pose.name},{pose.time_s!r},{pose.x!r},{pose.y!r}\n" for pose in poses()]
    (path / "poses.csv").write_text("".join(lines))
    return path


@pytest.fixture
def audit(folder, capsys):
    """Run `mtm-audit watch`; gives the exit code, standard output and standard error."""

    def run(*arguments, key="robot.key"):
        with pytest.raises(SystemExit) as left:
            main(["watch", *map(str, arguments), "--key", str(folder / key)])
        out, err = capsys.readouterr()
        assert "Traceback" not in out + err
        assert FAKE_SECRET.hex() not in out + err
        return left.value.code or 0, out, err

    return run


def test_poses_are_watched_up_to_the_verdict_and_kept(audit, folder, capsys):
    code, out, _ = audit(folder / "poses.csv", "--record", folder / "kept", "--page", "0")
    assert code == 0
    assert out.startswith("decoded: message 2 (0b10)")
    assert "looking again and again is paid for with" in out
    with pytest.raises(SystemExit) as left:
        main(["decode", str(folder / "kept"), "--key", str(folder / "robot.key")])
    assert (left.value.code or 0) == 0
    assert "message 2" in capsys.readouterr().out


def test_another_key_is_absent_at_the_end_of_the_time(audit, folder):
    code, out, _ = audit(folder / "poses.csv", "--seconds", "5", key="other.key")
    assert code == 3
    assert out.startswith("absent: ")
    assert "look at the end" in out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("no-such-file",), "cannot read"),
        (("tcp://127.0.0.1:9",), "cannot watch tcp://127.0.0.1:9"),
        (("gopher://127.0.0.1/",), "cannot be watched"),
        (("tcp://127.0.0.1:9", "--tracker", "football"), "takes whole films alone"),
    ],
)
def test_what_cannot_be_watched_is_one_sentence(audit, arguments, words):
    code, out, err = audit(*arguments)
    assert (code, out) == (1, "")
    assert words in err
    assert err.count("\n") == 1


def test_a_page_without_its_library_is_one_sentence(audit, folder, monkeypatch):
    monkeypatch.delitem(sys.modules, "mtm_audit.live.page", raising=False)
    monkeypatch.setitem(sys.modules, "aiohttp", None)
    code, _, err = audit(folder / "poses.csv", "--page", "0")
    assert code == 1
    assert "--page needs aiohttp, which is not installed; install it with: " in err
    assert "[live]" in err


def test_a_folder_that_is_there_is_not_recorded_into(audit, folder):
    code, _, err = audit(folder / "poses.csv", "--record", folder)
    assert code == 1
    assert "exists already" in err


def test_an_interrupt_ends_with_the_best_answer_so_far(folder):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        address = probe.getsockname()
    command = [sys.executable, "-m", "mtm_audit", "watch", f"udp://127.0.0.1:{address[1]}", "--page", "0"]
    watch = subprocess.Popen(
        [*command, "--key", str(folder / "other.key")], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
        env=os.environ | {"OPENBLAS_NUM_THREADS": "1"},
    )  # fmt: skip
    stopped = threading.Event()

    def send():
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            number = 0
            while not stopped.wait(0.02):
                sender.sendto(b"robot0,%.2f,%.3f,0.0\n" % (0.02 * number, 0.01 * number), address)
                number += 1

    sending = threading.Thread(target=send, daemon=True)
    sending.start()
    try:
        assert "the page is http://127.0.0.1:" in watch.stderr.readline()
        stopped.wait(3.0)
        watch.send_signal(signal.SIGINT)
        out, err = watch.communicate(timeout=PATIENCE_S)
    finally:
        stopped.set()
        sending.join()
        watch.kill()
    assert "Traceback" not in err
    assert "best answer so far" in err
    # How far it came in so short a time is up to the machine: absent, or too little to say.
    assert watch.returncode in (1, 3)
    assert ("absent" in out) == (watch.returncode == 3)
