"""A robot's journal as an auditor sees it: what the run was like, and the noise that it injected as ground truth."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from mtm_audit.model.glimpse import Glimpse
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.journal_file import (
    CLAMPED,
    HELD,
    NOISE,
    REFUSED,
    STALE,
    STOPPED,
    UNSENT,
    Event,
    JournalHeader,
    JournalRecord,
)

AXES = ("vx", "vy", "wz")
_FLAGS = {
    "with noise": NOISE, "clamped": CLAMPED, "stale": STALE, "refused": REFUSED, "stopped": STOPPED, "held": HELD,
    "unsent": UNSENT,
}  # fmt: skip


@dataclass(frozen=True)
class JournalSummary:
    """One run in numbers.

    `ticks` counts rows, those whose command never left included; `missed` counts ticks between the first and the last
    that have no row, since the loop came too late; `counts` the rows of each kind; `lateness_s` are the median, the
    99th percentile and the greatest. `energy` is the sum of the noise's square times the tick's length on each axis, in
    m^2/s and rad^2/s; `rms` its root mean square over the ticks with noise, in m/s and rad/s. Both are None where the
    journal leaves the noise out and no key has made it again, and do not count ticks in which a limit cut that.
    `saturation` is the share of ticks in which a limit cut something.
    """

    header: JournalHeader
    ticks: int
    first_tick: int
    last_tick: int
    missed: int
    lateness_s: tuple[float, float, float]
    counts: dict[str, int]
    energy: tuple[float, ...] | None
    rms: tuple[float, ...] | None
    saturation: float
    events: tuple[Event, ...]
    damaged: int

    def as_table(self) -> dict[str, Any]:
        """For JSON; every number is finite and nothing is secret."""
        header = self.header
        return {
            "schema_version": 1,
            "robot": header.robot,
            "channel": header.channel,
            "key_id": header.key_id,
            "fingerprint": header.fingerprint,
            "message": {
                "symbols": None if header.symbols is None else list(header.symbols),
                "repeat": header.repeat,
                "start_unix_s": header.start_unix_s,
                "rate_hz": header.rate_hz,
            },
            "ticks": {
                "sent": self.ticks - self.counts["unsent"], "missed": self.missed,
                "first": self.first_tick, "last": self.last_tick,
                **{name.replace(" ", "_"): count for name, count in self.counts.items()},
            },
            "lateness_s": dict(zip(("p50", "p99", "max"), self.lateness_s, strict=True)),
            "noise": self._noise(),
            "saturation": self.saturation,
            "events": [{"tick": event.tick, "text": event.text} for event in self.events],
            "damaged_lines": self.damaged,
        }  # fmt: skip

    def _noise(self) -> dict[str, dict[str, float]] | None:
        if self.energy is None or self.rms is None:
            return None
        return {
            axis: {"energy": energy, "rms": rms} for axis, energy, rms in zip(AXES, self.energy, self.rms, strict=True)
        }


def summary_of(record: JournalRecord) -> JournalSummary:
    """Count and measure; raises MtmError when the journal has no rows."""
    _check(record)
    ticks, noise = record.ticks, record.noise
    counts = {name: int(np.count_nonzero(record.flags & bit)) for name, bit in _FLAGS.items()}
    with_noise = ((record.flags & NOISE) != 0) & ((record.flags & UNSENT) == 0)
    known = ~np.isnan(noise).any(axis=1)
    squares, noisy = np.sum(noise[known] ** 2, axis=0), max(1, int(np.count_nonzero(with_noise & known)))
    said = bool((with_noise & known).any()) or not with_noise.any()
    median_s, late_s, worst_s = np.quantile(record.lateness_s, (0.5, 0.99, 1.0))
    return JournalSummary(
        record.header, len(ticks), int(ticks[0]), int(ticks[-1]), int(ticks[-1] - ticks[0] + 1) - len(np.unique(ticks)),
        (float(median_s), float(late_s), float(worst_s)), counts,
        tuple(float(value) for value in squares / record.header.rate_hz) if said else None,
        tuple(float(value) for value in np.sqrt(squares / noisy)) if said else None,
        counts["clamped"] / len(ticks), record.events, record.damaged,
    )  # fmt: skip


def injected_noise(record: JournalRecord, start_s: float | None = None) -> Glimpse:
    """The noise, sent minus base, as the glimpse that a perfect observer of a perfect robot would have had.

    One interval a tick, axes vx, vy and wz. `start_s` is when the message begins on the clock that the times should be
    in, such as a recording's; without it they are seconds since the Unix epoch, or since the start in simulated time.
    In a tick that is missing the robot kept its last command: the noise is held and the interval not valid. Nor is it
    valid in ticks whose noise the journal leaves out, see `journal_noise.with_noise`. Raises MtmError when the journal
    has no rows.
    """
    _check(record)
    if start_s is None:
        start_s = record.header.start_unix_s or 0.0
    places = record.ticks - record.ticks[0]
    rows = np.zeros(int(places[-1]) + 1, dtype=np.int64)
    rows[places] = np.arange(len(places))
    valid = np.zeros(len(rows), dtype=np.bool_)
    noise = record.noise
    valid[places] = ~np.isnan(noise).any(axis=1)
    noise = np.nan_to_num(noise)
    edges_s = start_s + (record.ticks[0] + np.arange(len(rows) + 1)) / record.header.rate_hz
    return Glimpse(record.header.robot, edges_s, noise[np.maximum.accumulate(rows)], valid, AXES)


def _check(record: JournalRecord) -> None:
    if not len(record.ticks):
        raise MtmError("the journal has no ticks; name one of a run that drove the robot")
    if np.any(np.diff(record.ticks) < 0):
        raise MtmError("the journal's ticks run backwards, so it is no one run's; name the files of a single run")
