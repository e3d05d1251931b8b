"""`mtm-audit profile`: learn how a type of robot follows commands from a recording that decodes."""

import sys
from dataclasses import dataclass, field
from pathlib import Path

from mtm_audit.commands.unused import unused_options
from mtm_audit.decoding.decode import decode_tracks
from mtm_audit.decoding.decoding import Decoding
from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.detectors.base import Observation
from mtm_audit.detectors.matched.learn import learn_profile
from mtm_audit.detectors.matched.profile import PlantProfile, save_profile
from mtm_audit.ingest.recording import read_recording, recording_files
from mtm_audit.model.lens import Lens
from mtm_audit.readers.logs.options import ReadOptions
from mtm_audit.tracking.registry import tracker
from mtm_onboard.protocol.errors import MtmError, command_line_values
from mtm_onboard.protocol.key import Key, load_key
from mtm_onboard.protocol.output_file import check_outputs


@dataclass(frozen=True)
class ProfileOptions:
    """What the command line asked for; `settings` decode the recording first, `lens` is that of a film's camera."""

    paths: tuple[Path, ...]
    key: Path
    out: Path
    tracker: str
    reference: tuple[str, ...]
    settings: DecodeSettings
    reading: ReadOptions = field(default_factory=ReadOptions)
    force: bool = False
    given: frozenset[str] = frozenset()
    lens: Lens | None = None


def run_profile(options: ProfileOptions) -> None:
    """Decode, learn, write. Raises MtmError when the recording does not decode, since its plant is then unknown."""
    check_outputs("mtm-audit profile", options.out, force=options.force)
    with command_line_values():
        tracker(options.tracker)
    key = load_key(options.key)
    files, kind = recording_files(options.paths)
    recording = read_recording(
        files, kind, options.tracker, options=options.reading, reference=options.reference, lens=options.lens
    )
    decoding = decode_tracks(recording.tracks, key, options.settings)
    if decoding.verdict != "decoded":
        raise MtmError(
            f"the verdict on this recording is {decoding.verdict!r}, so it does not show how the robot follows; "
            "record a longer message, or give its start with --onset"
        )
    save_profile(_learn(key, decoding), options.out)
    for warning in unused_options(options.given, kind, key.scheme.schedule):
        sys.stdout.write(f"warning: {warning}\n")
    sys.stdout.write(f"wrote {options.out}; give it to mtm-audit decode with --profile\n")


def _learn(key: Key, decoding: Decoding) -> PlantProfile:
    read = [
        (Observation(channel.channel, channel.glimpse), channel.reading)
        for channel in decoding.channels
        if channel.glimpse is not None and channel.reading is not None
    ]
    return learn_profile(key.codebook(), [observation for observation, _ in read], [reading for _, reading in read])
