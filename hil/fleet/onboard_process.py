"""`mtm-onboard run` in a process of its own, on a serial device that is simulated."""

import socket
import subprocess
from pathlib import Path

import numpy as np

from hil.fleet.programs import program
from hil.fleet.rig import LIMITS, RobotReport
from hil.fleet.serial_wires import SerialWire
from mtm_onboard.model.velocity import STOP
from mtm_onboard.protocol import MtmError
from mtm_onboard.protocol.journal_file import CLAMPED, REFUSED, STALE, UNSENT, JournalRecord, read_journal

_TERMINATION_TIMEOUT_S = 5.0

_CONFIG = """\
[robot]
name = "{name}"
channel = "{channel}"

[transport]
{transport}

[limits]
speed_mps = {speed_mps}
turn_rate_radps = {turn_rate_radps}

[source]
kind = "udp"
port = {udp_port}

[journal]
path = "{name}.csv"
"""


class OnboardProcess:
    """One robot's runtime; configuration, journal and output go to `folder` under the robot's `name`.

    `arguments` are what `mtm-onboard run` takes beside its configuration. Base commands are taken at `udp_port`.
    """

    def __init__(self, folder: Path, name: str, channel: str, wire: SerialWire, arguments: list[str]) -> None:
        self.name = name
        self.udp_port = _free_udp_port()
        self._folder = folder
        self._wire = wire
        config = _CONFIG.format(
            name=name, channel=channel, transport=wire.transport, udp_port=self.udp_port, speed_mps=LIMITS.speed_mps,
            turn_rate_radps=LIMITS.turn_rate_radps,
        )  # fmt: skip
        (folder / f"{name}.toml").write_text(config, encoding="utf-8")
        with (folder / f"{name}.log").open("wb") as log:
            # In a session of its own, so that a terminal's interrupt reaches it only through `end`.
            self._process = subprocess.Popen(
                [program("mtm-onboard"), "run", "--config", f"{name}.toml", *arguments],
                cwd=folder, stdin=subprocess.DEVNULL, stdout=log, stderr=log, start_new_session=True,
            )  # fmt: skip

    @property
    def is_running(self) -> bool:
        """Whether it has not ended."""
        return self._process.poll() is None

    def check(self, *, may_have_ended: bool) -> None:
        """Raise MtmError when it has ended with an error, or has ended before it may."""
        code = self._process.poll()
        if code or (code == 0 and not may_have_ended):
            words = (self._folder / f"{self.name}.log").read_text(encoding="utf-8", errors="replace").strip()
            raise MtmError(f"mtm-onboard of {self.name} ended with code {code} ({words[-300:] or 'no output'})")

    def end(self) -> None:
        """Ask it to stop the robot and end, and end it when it does not."""
        if self.is_running:
            self._process.terminate()
            try:
                self._process.wait(_TERMINATION_TIMEOUT_S)
            except subprocess.TimeoutExpired:
                self._process.kill()
        self._process.wait()

    def report(self) -> RobotReport:
        """The robot's report from its journal and the robot's end of the wire, after the program has ended.

        Raises MtmError when the journal lacks rows or shows a tick that was sent twice.
        """
        journal = read_journal(self._folder / f"{self.name}.csv")
        sent, missed = check_ticks(self.name, journal)
        flags, controller = journal.flags, self._wire.controller
        clamped, stale, refused = (int(np.count_nonzero(flags & bit)) for bit in (CLAMPED, STALE, REFUSED))
        median_s, late_s = np.quantile(journal.lateness_s, (0.5, 0.99))
        is_stopped = controller.demand == STOP and not (self._wire.stop_releases_motors and controller.work_mode)
        return RobotReport(
            name=self.name,
            sent=sent,
            missed=missed,
            clamped=clamped,
            stale=stale,
            refused=refused,
            faults=self._wire.faults(),
            deadman_stops=controller.deadman_stops,
            is_stopped=is_stopped,
            late_s=(float(median_s), float(late_s)),
        )


def check_ticks(name: str, journal: JournalRecord) -> tuple[int, int]:
    """Ticks that were sent, and ticks missed between the first and the last one.

    Raises MtmError when the journal is empty or damaged, begins after the message does, or has a tick twice.
    """
    ticks = journal.ticks
    if not len(ticks) or journal.damaged:
        raise MtmError(f"the journal of {name} has {len(ticks)} rows and {journal.damaged} damaged ones; run it again")
    if ticks[0] > 0:
        raise MtmError(f"{name} began at tick {ticks[0]}, after the message had; run it again on a less busy machine")
    if np.any(np.diff(ticks) < 1):
        raise MtmError(f"{name} sent a tick twice, which must never happen; see its journal")
    sent = int(np.count_nonzero((journal.flags & UNSENT) == 0))
    return sent, int(ticks[-1] - ticks[0] + 1) - len(ticks)


def _free_udp_port() -> int:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        port: int = probe.getsockname()[1]
        return port
