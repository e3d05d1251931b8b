"""The work of a batch on one recording: hash it, take or make its tracks, and decode them under every key."""

import hashlib
import json
import time
from dataclasses import asdict, dataclass, replace

from mtm_audit.batch.content import Content, content_of
from mtm_audit.batch.fingerprint import decoding_fingerprint, reading_fingerprint
from mtm_audit.batch.found import Found
from mtm_audit.batch.plan import Plan
from mtm_audit.batch.row import Row
from mtm_audit.batch.told import rows_of, told_under, unreadable_row
from mtm_audit.batch.trackcache import TrackCache, usual_folder
from mtm_audit.ingest.recording import read_recording
from mtm_audit.ingest.source import Source
from mtm_audit.model.recording import Recording
from mtm_onboard.protocol.errors import MtmError


@dataclass(frozen=True)
class Work:
    """One recording to read as `plan` says; `known_sha256` is what its files held when its rows were made, if ever."""

    plan: Plan
    found: Found
    known_sha256: str = ""


def read_rows(work: Work) -> tuple[Row, ...] | None:
    """The rows of a recording, or None when its files hold what they held when its rows were made.

    What is wrong with the recording is a row too. Raises MtmError for what is wrong with this machine: another version
    of the program, or other keys than where the batch began.
    """
    plan, found = work.plan, work.found
    if plan.code != decoding_fingerprint():
        raise MtmError("a worker runs another version of the program or its libraries; install the same everywhere")
    for key in plan.keys:
        key.load()
    began_s, sha256 = time.perf_counter(), ""
    try:
        if found.source is None:
            raise MtmError(found.refusal)
        source = found.source
        content = content_of(source.files)
        sha256 = content.sha256
        if sha256 == work.known_sha256:
            return None
        recording = _recording(plan, source, content)
        rows = rows_of(plan, found.name, [told_under(plan, key, recording) for key in plan.keys])
    except MtmError as error:
        rows = (unreadable_row(plan, found.name, str(error)),)
    except Exception as error:
        # Whatever a library makes of one file, the others are read.
        sentence = f"reading it failed unexpectedly ({type(error).__name__}: {error}); decode it alone, and report this"
        rows = (unreadable_row(plan, found.name, sentence),)
    spent_s = time.perf_counter() - began_s
    return tuple(replace(row, sha256=sha256, seconds=f"{spent_s:.2f}") for row in rows)


def _recording(plan: Plan, source: Source, content: Content) -> Recording:
    """The recording with its tracks; those of a film from the cache where they are there.

    Logs are read each time, which takes little, and some have their times in files beside them.
    """
    if source.kind != "video":
        recording = _read(plan, source)
    else:
        cache, name = TrackCache(plan.cache or usual_folder()), _cache_name(plan, source, content)
        kept = cache.find(name, source.files)
        recording = _read(plan, source) if kept is None else kept
        if kept is None:
            cache.keep(name, recording)
    return replace(recording, warnings=(*source.warnings, *recording.warnings))


def _read(plan: Plan, source: Source) -> Recording:
    return read_recording(
        source.files,
        source.kind,
        plan.tracker,
        options=plan.reading,
        frame_rate_hz=plan.frame_rate_hz,
        reference=plan.reference,
        lens=plan.lens,
    )


def _cache_name(plan: Plan, source: Source, content: Content) -> str:
    """What tracks of a film depend on: its files, whose names may be times, how they are tracked, and what tracks them.

    Where a film is several files, warnings may name their folder, so that a copy elsewhere is another one.
    """
    folder = str(source.files[0].parent) if len(source.files) > 1 else ""
    lens = None if plan.lens is None else asdict(plan.lens)
    asked = [plan.tracker, plan.reference, plan.frame_rate_hz, lens, folder]
    text = json.dumps([reading_fingerprint(), asked, content.files], sort_keys=True)
    return hashlib.sha256(text.encode()).hexdigest()
