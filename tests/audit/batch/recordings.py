"""Recordings for the tests of batches: motion capture of a robot that sent under one of two keys, or was silent."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from hil.sensors.motion_capture import write_tum
from mtm_audit.batch.found import Found
from mtm_audit.batch.plan import Plan, named_keys
from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.ingest.source import Source
from mtm_onboard.protocol import save_key
from mtm_onboard.protocol.key import Key
from mtm_onboard.protocol.revocation import RevocationList
from tests.audit.moving_robot import FAKE_SECRET, OTHER_SECRET, robot_track, scheme_of

SCHEME = scheme_of(symbols=(1,), ticks=300)
KEY, OTHER = Key("fake", FAKE_SECRET, SCHEME), Key("other", OTHER_SECRET, SCHEME)
SETTINGS = DecodeSettings(onset_s=1.0)


def record(path: Path, symbol: int | None, key: Key = KEY, seed: int = 0, seconds: float = 7.6) -> Path:
    """Motion capture of one robot that sent from one second on; `symbol` None is a robot that sent nothing."""
    track = robot_track(key, "robot0", None if symbol is None else (symbol,), seconds, onset_s=1.0, seed=seed)
    write_tum(replace(track, headings_rad=np.zeros(len(track.times_s))), path)
    return path


def save_keys(folder: Path) -> tuple[Path, Path]:
    """Files of both keys."""
    save_key(KEY, folder / "fake.key")
    save_key(OTHER, folder / "other.key")
    return folder / "fake.key", folder / "other.key"


def plan_of(keys, cache: Path, **changes) -> Plan:
    """A plan for these key files."""
    return Plan(**{"keys": named_keys(keys, RevocationList()), "settings": SETTINGS, "cache": cache} | changes)


def found_at(path: Path) -> Found:
    """A log that was found."""
    return Found(str(path), Source((path,), "motion capture"))
