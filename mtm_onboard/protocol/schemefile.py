"""The scheme file: a scheme without a key, in TOML, as `mtm-audit plan` writes and `mtm-onboard keygen` reads it."""

from dataclasses import asdict
from pathlib import Path

from mtm_onboard.protocol.atomicfile import replacing
from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.input_file import BrokenTextError, parsed_toml, read_text
from mtm_onboard.protocol.scheme import Scheme, scheme_from_table

_SCHEME_PARAMETERS = (
    "version", "name", "rate_hz", "band_hz", "alphabet_size", "message_ticks",
    "combine", "pooling", "power", "schedule", "epoch",
)  # fmt: skip
_CHANNEL_PARAMETERS = ("name", "body", "axes", "symbols", "sigma")


def scheme_text(scheme: Scheme) -> str:
    """The scheme as the TOML table `[scheme]`, in scheme files and key files alike."""
    lines = ["[scheme]", *(f"{name} = {_toml(getattr(scheme, name))}" for name in _SCHEME_PARAMETERS)]
    if scheme.spectrum is not None:
        lines.append(f"spectrum = {_toml(scheme.spectrum)}")
    if scheme.framing is not None:
        lines += ["", "[scheme.framing]"]
        lines += [f"{name} = {_toml(value)}" for name, value in asdict(scheme.framing).items()]
    for channel in scheme.channels:
        lines += ["", "[[scheme.channels]]"]
        lines += [f"{name} = {_toml(getattr(channel, name))}" for name in _CHANNEL_PARAMETERS]
    return "\n".join(lines) + "\n"


def save_scheme(scheme: Scheme, path: Path, comments: tuple[str, ...] = ()) -> None:
    """Write a scheme file after its comments, whole or not at all."""
    with replacing(path) as temporary:
        temporary.write_text("".join(f"# {comment}\n" for comment in comments) + scheme_text(scheme), encoding="utf-8")


def load_scheme(path: Path) -> Scheme:
    """Read a scheme file; raises MtmError with one sentence that says what to change."""
    try:
        table = parsed_toml(read_text(path, "the scheme file"))
    except BrokenTextError:
        # The parser's message may quote a line, and the file may be a key's.
        raise MtmError(f"{path} is not a scheme file; name one that mtm-audit plan wrote") from None
    if table.keys() != {"scheme"} or not isinstance(table["scheme"], dict):
        raise MtmError(f"{path} must hold one table, [scheme], and nothing else; name one that mtm-audit plan wrote")
    try:
        return scheme_from_table(table["scheme"])
    except MtmError as error:
        raise MtmError(f"{path}: {error}") from error


def _toml(value: object) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return f'"{value}"'
    if isinstance(value, tuple):
        return "[" + ", ".join(_toml(item) for item in value) + "]"
    return repr(value)
