"""The program on the page about a robot runs as it stands, and the runtime's port hears what it says."""

import re
import socket
from pathlib import Path

from mtm_onboard.model.velocity import BodyVelocity
from mtm_onboard.runtime.base_command import STOP_TEXT, velocity_text

PAGE = (Path(__file__).parents[2] / "docs" / "onboard.md").read_text(encoding="utf-8")


def test_the_program_sends_base_commands_and_a_stop(monkeypatch):
    monkeypatch.setattr("time.sleep", lambda seconds: None)
    (block,) = re.findall(r"^    ```python\n(.*?)^    ```", PAGE, re.DOTALL | re.MULTILINE)
    program = re.sub(r"^    ", "", block, flags=re.MULTILINE)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as port:
        port.bind(("127.0.0.1", 0))
        port.settimeout(5.0)
        assert "port=5005" in program
        exec(program.replace("port=5005", f"port={port.getsockname()[1]}"), {})
        heard = [port.recv(100) for _ in range(151)]
    assert set(heard[:-1]) == {velocity_text(BodyVelocity(0.3, 0.0, 0.0))}
    assert heard[-1] == STOP_TEXT
