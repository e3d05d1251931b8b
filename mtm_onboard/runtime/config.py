"""The robot's configuration: one TOML file, explained field by field in examples/robots/none.toml."""

import math
from dataclasses import MISSING, dataclass, fields
from pathlib import Path
from types import UnionType
from typing import Any, TypeVar, get_args, get_type_hints

from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.input_file import BrokenTextError, parsed_toml, read_text
from mtm_onboard.runtime.guard import Limits, Staleness

Option = str | int | float | bool
_SECTIONS = ("robot", "transport", "link", "limits", "stale", "source", "journal", "state", "control", "realtime")
_OPTIONAL_SECTIONS = ("link", "stale", "journal", "state", "control", "realtime")
_SOURCE_KINDS = ("unix", "udp", "stdin")
_T = TypeVar("_T")


@dataclass(frozen=True)
class Robot:
    """The robot's name in journals and the scheme's channel that it plays."""

    name: str
    channel: str


@dataclass(frozen=True)
class SourceSettings:
    """Where base commands come from: "unix" with the path of a `socket`, "udp" with a loopback `port`, or "stdin"."""

    kind: str = "unix"
    socket: str | None = None
    port: int | None = None

    def __post_init__(self) -> None:
        if self.kind not in _SOURCE_KINDS:
            raise MtmError(f"kind is {self.kind!r}; choose one of: {', '.join(_SOURCE_KINDS)}")
        if (self.kind == "unix") != bool(self.socket):
            raise MtmError("a socket belongs to kind unix and to no other; add its path or remove it")
        if (self.kind == "udp") != (self.port is not None):
            raise MtmError("a port belongs to kind udp and to no other; add or remove it")
        if self.port is not None and not 1 <= self.port <= 65_535:
            raise MtmError(f"port is {self.port}; choose 1 to 65535")

    def __str__(self) -> str:
        return {
            "unix": f"the socket {self.socket}", "udp": f"UDP port {self.port}", "stdin": "standard input",
        }[self.kind]  # fmt: skip


@dataclass(frozen=True)
class LinkSettings:
    """Whether a lost link is opened anew, and after how long without one the run ends with an error.

    A robot that stood still for long may have people near it by then, so waiting for ever is a choice, `inf`.
    """

    reconnect: bool = True
    give_up_s: float = 60.0

    def __post_init__(self) -> None:
        if not self.give_up_s > 0:
            raise MtmError(f"give_up_s is {self.give_up_s}; give seconds above zero")


@dataclass(frozen=True)
class JournalSettings:
    """Where the journal goes, and how many megabytes of it are kept at most; the oldest go first."""

    path: str
    max_mb: float = 200.0

    def __post_init__(self) -> None:
        if not 1.0 <= self.max_mb < math.inf:
            raise MtmError(f"max_mb is {self.max_mb}; give a number from 1 on")


@dataclass(frozen=True)
class StateSettings:
    """The path of the ledger, which keeps from run to run which slots were played and how messages are numbered."""

    path: str


@dataclass(frozen=True)
class ControlSettings:
    """The path of the control socket, which takes another message or the operator's stop while the robot runs."""

    socket: str


@dataclass(frozen=True)
class RealtimeSettings:
    """What the loop asks of the system: a `priority` under SCHED_FIFO, its memory locked, the processor `cpu` alone.

    None and False leave things as they are. Raises MtmError for a priority or processor that no system has.
    """

    priority: int | None = None
    lock_memory: bool = False
    cpu: int | None = None

    def __post_init__(self) -> None:
        if self.priority is not None and not 1 <= self.priority <= 99:
            raise MtmError(f"priority is {self.priority}; choose 1 to 99, or leave it out")
        if self.cpu is not None and not 0 <= self.cpu < 1024:
            raise MtmError(f"cpu is {self.cpu}; choose the number of a processor, from 0 on, or leave it out")


@dataclass(frozen=True, kw_only=True)
class RobotConfig:
    """All of it. `transport_options` are the fields of [transport] beside its kind.

    `journal`, `state` and `control` may be absent.
    """

    robot: Robot
    transport_kind: str
    transport_options: dict[str, Option]
    limits: Limits
    staleness: Staleness
    source: SourceSettings
    journal: JournalSettings | None
    link: LinkSettings = LinkSettings()
    control: ControlSettings | None = None
    realtime: RealtimeSettings = RealtimeSettings()
    state: StateSettings | None = None

    @property
    def ledger_path(self) -> Path | None:
        """Where the ledger lies: as [state] says, else beside the journal; None without both."""
        if self.state is not None:
            return Path(self.state.path)
        return None if self.journal is None else Path(f"{self.journal.path}.state")


def load_config(path: Path) -> RobotConfig:
    """Read a configuration; raises MtmError with one sentence that says what to change."""
    try:
        table = parsed_toml(read_text(path, "the configuration"))
    except BrokenTextError as error:
        raise MtmError(f"{path} is not valid TOML ({error}); correct that line, or name another file") from error
    try:
        return config_from_table(table)
    except MtmError as error:
        raise MtmError(f"{path}: {error}") from error


def config_from_table(table: dict[str, Any]) -> RobotConfig:
    """Build the configuration from a parsed table; raises MtmError as `load_config` does."""
    for name, section in table.items():
        if name not in _SECTIONS:
            raise MtmError(f"unknown section or field {name!r}; remove it or correct its spelling")
        if not isinstance(section, dict):
            raise MtmError(f"{name!r} must be a section; write [{name}]")
    missing = [name for name in _SECTIONS if name not in table and name not in _OPTIONAL_SECTIONS]
    if missing:
        raise MtmError(f"the section [{missing[0]}] is missing; add it")
    kind, options = _transport(table["transport"])
    return RobotConfig(
        robot=_section(Robot, "robot", table["robot"]),
        transport_kind=kind,
        transport_options=options,
        limits=_section(Limits, "limits", table["limits"]),
        staleness=_section(Staleness, "stale", table.get("stale", {})),
        source=_section(SourceSettings, "source", table["source"]),
        journal=_section(JournalSettings, "journal", table["journal"]) if "journal" in table else None,
        control=_section(ControlSettings, "control", table["control"]) if "control" in table else None,
        link=_section(LinkSettings, "link", table.get("link", {})),
        realtime=_section(RealtimeSettings, "realtime", table.get("realtime", {})),
        state=_section(StateSettings, "state", table["state"]) if "state" in table else None,
    )


def _transport(table: dict[str, Any]) -> tuple[str, dict[str, Option]]:
    if not isinstance(table.get("kind"), str):
        raise MtmError('[transport] needs a kind in quotes, such as kind = "none"')
    for name, value in table.items():
        if not isinstance(value, Option):
            raise MtmError(f"[transport] {name} is {value!r}; give text, a number, true or false")
    return table["kind"], {name: value for name, value in table.items() if name != "kind"}


def _section(kind: type[_T], section: str, table: dict[str, Any]) -> _T:
    hints = get_type_hints(kind)
    for name, value in table.items():
        if name not in hints:
            raise MtmError(f"[{section}] has an unknown field {name!r}; remove it or correct its spelling")
        _check_type(section, name, value, hints[name])
    for entry in fields(kind):  # type: ignore[arg-type]
        if entry.default is MISSING and entry.name not in table:
            raise MtmError(f"[{section}] lacks {entry.name}; add it")
    try:
        return kind(**table)
    except MtmError as error:
        raise MtmError(f"[{section}]: {error}") from error


def _check_type(section: str, name: str, value: Any, hint: Any) -> None:
    wanted = set(get_args(hint)) - {type(None)} if isinstance(hint, UnionType) else {hint}
    words = {str: "text in quotes", int: "a whole number", float: "a number", bool: "true or false"}
    if float in wanted:
        wanted.add(int)
    if type(value) not in wanted:
        expected = "a number" if float in wanted else words[wanted.pop()]
        raise MtmError(f"[{section}] {name} is {value!r}; give {expected}")
