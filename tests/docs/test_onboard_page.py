"""The program on the page about a robot runs as it stands, and the runtime's socket takes what it sends."""

import re
import socket
import threading
from pathlib import Path

from mtm_onboard.model.velocity import BodyVelocity
from mtm_onboard.runtime.base_command import STOP_TEXT, velocity_text

PAGE = (Path(__file__).parents[2] / "docs" / "onboard.md").read_text(encoding="utf-8")


def test_the_program_sends_base_commands_and_a_stop(monkeypatch, tmp_path):
    (block,) = re.findall(r"^    ```python\n(.*?)^    ```", PAGE, re.DOTALL | re.MULTILINE)
    program = re.sub(r"^    ", "", block, flags=re.MULTILINE)
    received: list[bytes] = []
    # The program's pause between two commands, which here ends when the command was read.
    pause = threading.Semaphore(0)
    monkeypatch.setattr("time.sleep", lambda seconds: pause.acquire(timeout=5.0))
    monkeypatch.chdir(tmp_path)
    with socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM) as runtime:
        runtime.bind("robot0.base")
        runtime.settimeout(5.0)

        def read() -> None:
            for _ in range(151):
                received.append(runtime.recv(100))
                pause.release()

        reader = threading.Thread(target=read)
        reader.start()
        exec(program, {})
        reader.join()
    assert set(received[:-1]) == {velocity_text(BodyVelocity(0.3, 0.0, 0.0))}
    assert received[-1] == STOP_TEXT
