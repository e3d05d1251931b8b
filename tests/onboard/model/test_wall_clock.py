import subprocess
import sys

import pytest

from mtm_onboard.model.wall_clock import is_synchronised


@pytest.mark.skipif(sys.platform != "linux", reason="other systems have no adjtimex")
def test_the_kernel_is_asked_as_others_ask_it(monkeypatch):
    program = "import ctypes; b = ctypes.create_string_buffer(1024); print(ctypes.CDLL(None).adjtimex(b))"
    asked = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    # Its answer is TIME_ERROR (5) for a clock that is not synchronised.
    assert is_synchronised() is (int(asked.stdout) != 5)


def test_a_system_that_does_not_say_is_neither(monkeypatch):
    class Silent:
        def __init__(self, answer):
            if answer is not None:
                self.adjtimex = lambda state: answer

    for answer in (None, -1):
        monkeypatch.setattr("ctypes.CDLL", lambda name, answer=answer: Silent(answer))
        assert is_synchronised() is None
