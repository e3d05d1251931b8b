"""What runs on the auditor's machine: from a recording to a verdict."""

from importlib import import_module
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from mtm_audit.decoding.decode import decode_tracks
    from mtm_audit.decoding.decoding import ChannelDecoding, Decoding
    from mtm_audit.decoding.files import decode
    from mtm_audit.decoding.settings import DecodeSettings
    from mtm_audit.model.lens import Lens
    from mtm_audit.model.recorded_at import RecordedAt
    from mtm_audit.model.track import Track
    from mtm_audit.readers.lens_file import read_lens
    from mtm_audit.readers.logs.options import ReadOptions
    from mtm_audit.significance.evidence import Evidence
    from mtm_onboard.protocol.errors import MtmError
    from mtm_onboard.protocol.key import Key, load_key

__all__ = [
    "ChannelDecoding",
    "DecodeSettings",
    "Decoding",
    "Evidence",
    "Key",
    "Lens",
    "MtmError",
    "ReadOptions",
    "RecordedAt",
    "Track",
    "decode",
    "decode_tracks",
    "load_key",
    "read_lens",
]

# A name's module is imported when the name is first used, so that help is shown without numpy.
_MODULES = {
    "ChannelDecoding": "mtm_audit.decoding.decoding",
    "DecodeSettings": "mtm_audit.decoding.settings",
    "Decoding": "mtm_audit.decoding.decoding",
    "Evidence": "mtm_audit.significance.evidence",
    "Key": "mtm_onboard.protocol.key",
    "Lens": "mtm_audit.model.lens",
    "MtmError": "mtm_onboard.protocol.errors",
    "ReadOptions": "mtm_audit.readers.logs.options",
    "RecordedAt": "mtm_audit.model.recorded_at",
    "Track": "mtm_audit.model.track",
    "decode": "mtm_audit.decoding.files",
    "decode_tracks": "mtm_audit.decoding.decode",
    "load_key": "mtm_onboard.protocol.key",
    "read_lens": "mtm_audit.readers.lens_file",
}


def __getattr__(name: str) -> object:
    if name not in _MODULES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_MODULES[name]), name)


def __dir__() -> list[str]:
    return sorted({*globals(), *__all__})
