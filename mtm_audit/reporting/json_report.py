"""The decode as JSON, for programs; docs/decode-json.md describes it and decode.schema.json checks it."""

import json
import math
from collections.abc import Mapping
from importlib.metadata import version
from typing import Any

import numpy as np

from mtm_audit.decoding.decoding import ChannelDecoding, Decoding
from mtm_audit.decoding.frames import Delivered
from mtm_audit.model.recording import Recording
from mtm_audit.reporting.basis import Basis
from mtm_audit.reporting.delivery import late_s
from mtm_audit.reporting.text import message_bits
from mtm_audit.significance.decoys import DecoyComparison
from mtm_onboard.protocol.installing import DISTRIBUTION
from mtm_onboard.protocol.slots import slot_start_unix_s

SCHEMA_VERSION = 2
_NO_BASIS = Basis()


def json_report(recording: Recording, decoding: Decoding, warnings: tuple[str, ...], basis: Basis = _NO_BASIS) -> str:
    """The whole answer as one JSON object with a newline at its end; numbers are finite, nothing in it is secret."""
    evidence, scheme = decoding.evidence, decoding.scheme
    heading_axes = {track.name: track.heading_axis for track in recording.tracks}
    report = {
        "schema_version": SCHEMA_VERSION,
        "program": {"name": "mtm-audit", "version": version(DISTRIBUTION)},
        "verdict": decoding.verdict,
        "message": decoding.message.hex() if isinstance(decoding.message, bytes) else decoding.message,
        "message_bits": message_bits(decoding),
        "frames": [_frame(frame, decoding, basis) for frame in decoding.frames if frame.message.payload is not None],
        "symbols": _symbols(decoding),
        "p_value": evidence.p_value,
        "threshold": decoding.settings.threshold,
        "exact": evidence.nats is not None,
        "evidence_bits": evidence.bits,
        "symbol_bits_needed": None if evidence.nats is None else _bits(decoding.needed_nats),
        "decoys": _decoys(evidence.decoys),
        "key_id": decoding.key_id,
        "scheme": {"name": scheme.name, "fingerprint": scheme.fingerprint},
        "detector": decoding.settings.detector,
        "reference_frame": decoding.frame,
        "channels": [_channel(channel, heading_axes) for channel in decoding.channels],
        "recording": {
            "paths": [str(path) for path in recording.paths],
            "kind": recording.kind,
            "duration_s": recording.duration_s,
            "frames": recording.frames,
            "speed": recording.speed,
            "piece_s": None if decoding.piece is None else list(decoding.piece),
        },
        "together": [
            {"recording": name, "verdict": each.verdict, "evidence_bits": each.evidence.bits}
            for name, each in zip(recording.together, decoding.together, strict=True)
        ],
        "rests_on": list(basis.sentences),
        "late_s": late_s(decoding),
        "warnings": list(warnings),
    }
    return json.dumps(report, indent=2, allow_nan=False) + "\n"


def _frame(frame: Delivered, decoding: Decoding, basis: Basis) -> dict[str, Any]:
    """One framed message; bytes are written as hexadecimal digits."""
    message, framing = frame.message, decoding.scheme.framing
    rolling = decoding.scheme.schedule == "rolling"
    return {
        "payload_kind": None if framing is None else framing.payload,
        "payload": message.payload.hex() if isinstance(message.payload, bytes) else message.payload,
        "number": message.number,
        "check": message.check,
        "check_bits": message.check_bits,
        "check_passed": message.check_passed,
        "authenticated": message.authenticated and basis.authenticates,
        "false_acceptance": message.false_acceptance,
        "posterior": message.posterior,
        "epoch": message.epoch,
        "slot_start_unix_s": slot_start_unix_s(frame.slots[0], decoding.scheme) if rolling else None,
        "start_s": frame.start_s,
        "end_s": frame.end_s,
    }


def _symbols(decoding: Decoding) -> list[dict[str, Any]]:
    """Empty when no message is there: symbols of chance must not look like one."""
    if decoding.verdict == "absent":
        return []
    return [
        {
            "symbol": symbol,
            "posterior": None if symbol is None else float(decoding.posteriors[place, symbol]),
            "bits": _bits(decoding.symbol_nats[place]),
            "certain": place not in decoding.uncertain,
        }
        for place, symbol in enumerate(decoding.symbols)
    ]


def _decoys(comparison: DecoyComparison | None) -> dict[str, Any] | None:
    """The comparison with decoy keys; None when none were searched."""
    if comparison is None:
        return None
    strengths = comparison.decoy_strengths
    return {
        "count": len(strengths),
        "strength": comparison.strength,
        "mean": float(np.mean(strengths)),
        "sd": float(np.std(strengths, ddof=1)),
        "p_value": comparison.p_value,
    }


def _bits(nats: float | None) -> float | None:
    return None if nats is None else nats / math.log(2.0)


def _channel(decoding: ChannelDecoding, heading_axes: Mapping[str, str | None]) -> dict[str, Any]:
    channel, glimpse, reading = decoding.channel, decoding.glimpse, decoding.reading
    return {
        "name": channel.name,
        "body": channel.body,
        "track": None if glimpse is None else glimpse.name,
        "heading_axis": None if glimpse is None else heading_axes.get(glimpse.name),
        "track_searched": decoding.searched,
        "track_exchanged": decoding.exchanged,
        "state": decoding.state,
        "evidence_bits": _bits(decoding.nats),
        "onset_s": decoding.onset_s,
        "rate_hz": None if reading is None else reading.timing.rate_hz,
        "windows": 0 if reading is None else len(reading.window_positions),
        "scores": None if reading is None else reading.scores.tolist(),
    }
