"""The schemes of several keys, by which an experiment names its rows."""

from collections.abc import Mapping, Sequence
from pathlib import Path

from mtm_onboard.protocol import MtmError, Scheme, load_key


def schemes_of(keys: Sequence[Path]) -> Mapping[str, Scheme]:
    """Each key's scheme by the key's name; raises MtmError when one cannot be read or two have one name."""
    schemes = {key.id: key.scheme for key in map(load_key, keys)}
    if len(schemes) < len(keys):
        raise MtmError("two of the keys have one name; make them with different --id")
    return schemes


def scheme_notes(schemes: Mapping[str, Scheme]) -> tuple[str, ...]:
    """What a table of results says of them: each name's fingerprint."""
    return tuple(f"{name}: scheme {scheme.fingerprint}" for name, scheme in schemes.items())
