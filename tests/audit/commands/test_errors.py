"""How a command ends when it is asked to."""

import os
import signal
import sys
import time

import pytest

from mtm_audit.commands import errors


class AskedWhileDying:
    """Is asked to end inside its destructor, where Python drops every exception."""

    def __del__(self):
        os.kill(os.getpid(), signal.SIGTERM)
        # The handler runs between two instructions of this function.
        for _ in range(10):
            pass


def ask_while_dying_and_go_on():
    with errors.reported("mtm", "nothing was written"):
        AskedWhileDying()
        time.sleep(60.0)


def test_a_request_lost_in_a_destructor_is_made_again(monkeypatch):
    monkeypatch.setattr(errors, "_AGAIN_S", 0.05)
    monkeypatch.setattr(sys, "unraisablehook", lambda _: None)
    with pytest.raises(SystemExit) as ended:
        ask_while_dying_and_go_on()
    assert ended.value.code == 143


def test_no_request_is_left_behind():
    with errors.reported("mtm", "nothing was written"):
        pass
    assert signal.getitimer(signal.ITIMER_REAL) == (0.0, 0.0)
