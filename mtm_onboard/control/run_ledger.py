"""The ledger of a run, and what the rolling schedule asks of a computer before anything is played."""

from mtm_onboard.journal.ledger import Ledger
from mtm_onboard.model.wall_clock import SimulatedWallClock, WallClock
from mtm_onboard.protocol import Key, MtmError
from mtm_onboard.runtime.config import RobotConfig


def ledger_of_run(config: RobotConfig, key: Key, wall: WallClock, *, allow_unsynchronised: bool) -> Ledger | None:
    """The ledger, where one is needed: for slots under the rolling schedule, for numbers where frames carry them.

    Raises MtmError when the rolling schedule may not be played here: on a clock that nobody keeps right, or without a
    place for the ledger, unless `allow_unsynchronised`. In simulated time there is nothing to remember.
    """
    scheme, path = key.scheme, config.ledger_path
    if isinstance(wall, SimulatedWallClock):
        return None
    rolling = scheme.schedule == "rolling"
    if rolling and not allow_unsynchronised:
        if wall.is_synchronised() is not True:
            raise MtmError(
                "the kernel does not report this computer's clock as synchronised, and the rolling schedule follows "
                "it; wait for its NTP client (chrony with rtcsync, or systemd-timesyncd), or give "
                "--allow-unsynchronised in a lab"
            )
        if path is None:
            raise MtmError(
                "nothing says where to keep which slots were played, and a restart could play them again; add [state] "
                "with a path"
            )
    carries_number = scheme.framing is not None and scheme.framing.number_bits > 0
    if path is None or not (rolling or carries_number):
        return None
    return Ledger(path, key.id, scheme.fingerprint)
