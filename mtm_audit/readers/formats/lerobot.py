"""LeRobot's tables of episodes (parquet), by pyarrow: the robot's state at frames of a nominal rate."""

import json
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from mtm_audit.model.track import Floats, Track
from mtm_audit.readers.logs.body import Body, Log, Warn
from mtm_audit.readers.logs.choosing import check_topics, choose
from mtm_audit.readers.logs.libraries import foreign, library
from mtm_audit.readers.logs.opening import Opening
from mtm_audit.readers.logs.options import ReadOptions
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.input_file import BrokenTextError, read_text

WHAT = "a parquet table"
_STATE, _TIME, _EPISODE = "observation.state", "timestamp", "episode_index"
_X, _Y, _YAW = ("x", "pos_x", "x.pos"), ("y", "pos_y", "y.pos"), ("theta", "yaw", "theta.pos")
_LARGEST_INFO = 10_000_000


@dataclass(frozen=True)
class _Rows:
    episodes: Floats
    times_s: Floats
    states: Floats


def recognises_lerobot(opening: Opening) -> bool:
    """Whether it begins with the magic bytes of parquet."""
    return opening.start.startswith(b"PAR1")


def read_lerobot(path: Path, options: ReadOptions, warn: Warn) -> Log:
    """The state of one episode: a body when it has x and y, else a track with an axis for each joint.

    Names of the state come from `meta/info.json` of the data set. Time stamps are frames over the data set's rate,
    whatever the loop did, which `warn` is told. Raises MtmError that lists the episodes when there are several.
    """
    parquet = library("pyarrow.parquet", path, WHAT, "parquet")
    with foreign(path, WHAT):
        table = parquet.read_table(str(path))
        missing = [name for name in (_STATE, _TIME) if name not in table.column_names]
        if missing:
            raise MtmError(
                f"{path} is {WHAT} without the column {missing[0]!r}, so it is none of LeRobot's; export text"
            )
        rows = _rows(table)
    chosen = _chosen(path, rows, options)
    warn(f"{path}: LeRobot's time stamps are frames over a nominal rate, so the true instants are not in the file")
    names = _state_names(path, rows.states.shape[1])
    logs = [_log(name, rows, episode, names, options) for name, episode in chosen.items()]
    return Log(tuple(b for log in logs for b in log.bodies), tuple(t for log in logs for t in log.tracks))


def _rows(table: Any) -> _Rows:
    columns = {name: table.column(name).to_pylist() for name in (_STATE, _TIME)}
    times_s = np.array(columns[_TIME], dtype=float)
    episodes = np.array(table.column(_EPISODE).to_pylist() if _EPISODE in table.column_names else [0] * len(times_s))
    return _Rows(episodes, times_s, np.array(columns[_STATE], dtype=float).reshape(len(times_s), -1))


def _chosen(path: Path, rows: _Rows, options: ReadOptions) -> dict[str, int]:
    present = {f"episode_{int(number)}": int(number) for number in np.unique(rows.episodes)}
    check_topics(path, options.topics, list(present))
    if not present:
        raise MtmError(f"{path} is {WHAT} without rows; record it again")
    if not options.topics and len(present) > 1:
        raise choose(path, list(present))
    return (
        {name: present[name] for name in options.topics}
        if options.topics
        else {path.stem: next(iter(present.values()))}
    )


def _log(name: str, rows: _Rows, episode: int, names: list[str], options: ReadOptions) -> Log:
    here = rows.episodes == episode
    times_s, states = rows.times_s[here] * options.seconds(), rows.states[here]
    x, y, yaw = (next((names.index(n) for n in known if n in names), None) for known in (_X, _Y, _YAW))
    if x is not None and y is not None:
        positions_m = np.stack([states[:, x], states[:, y], np.zeros(len(states))], axis=1) * options.metres()
        return Log((Body(name, times_s, positions_m, headings_rad=None if yaw is None else states[:, yaw]),))
    valid = np.all(np.isfinite(states), axis=1)
    return Log(tracks=(Track(name, times_s, np.where(valid[:, None], states, np.nan), valid, tuple(names), "rad"),))


def _state_names(path: Path, count: int) -> list[str]:
    """Names of the state's numbers, or joint0, joint1 and so on where the data set does not tell."""
    for folder in list(path.parents)[:3]:
        info = folder / "meta" / "info.json"
        if info.is_file():
            try:
                names = json.loads(read_text(info, "the data set's description", _LARGEST_INFO))["features"][_STATE][
                    "names"
                ]
            except (BrokenTextError, ValueError, KeyError, TypeError, RecursionError):
                break
            # Older versions group them: {"motors": [...]}.
            found = [str(n) for n in (next(iter(names.values()), []) if isinstance(names, dict) else names or [])]
            if len(found) == count:
                return found
    return [f"joint{number}" for number in range(count)]
