"""Several recordings, decoded one after the other."""

import sys
from collections.abc import Callable, Sequence

from mtm_audit.ingest.source import Source
from mtm_onboard.protocol.errors import MtmError

_ABSENT, _MIXED = 3, 4


def run_each(
    sources: Sequence[Source], single: Sequence[str], as_json: bool, report: Callable[[Source], tuple[str, int]]
) -> int:
    """Print each report under its recording's name, or all as one JSON array; returns the exit code of all.

    1 when one could not be read, 0 when all are decoded, 3 when all are absent, else 4. Raises MtmError when one of
    the `single` options is given, each of which shows one recording.
    """
    if single:
        raise MtmError(f"{single[0]} is of one recording, and {len(sources)} are named; name one")
    codes: list[int] = []
    texts: list[str] = []
    for source in sources:
        try:
            text, code = report(source)
        except MtmError as error:
            sys.stderr.write(f"mtm-audit: {source.name}: {error}\n")
            codes.append(1)
            continue
        codes.append(code)
        texts.append(text)
        if not as_json:
            sys.stdout.write(f"== {source.name}\n{text}\n")
            sys.stdout.flush()
    if as_json:
        sys.stdout.write("[" + ",\n".join(text.rstrip("\n") for text in texts) + "]\n")
    return _together(codes)


def check_together(recordings: int, times: int, onset_s: float | None, speed: float | None) -> None:
    """Raise MtmError unless so many recordings can be decoded together, for which so many times are given."""
    if recordings < 2:
        raise MtmError("--together needs two recordings or more; name them, each a film, a log or a folder of logs")
    if onset_s is not None:
        raise MtmError("--onset is an instant of one recording; leave it or --together out")
    if speed is None:
        raise MtmError("--search-speed looks at one recording; find its speed alone, and give it as --speed")
    if times not in (0, recordings):
        raise MtmError(f"--at says when {times} of {recordings} recordings began; name one time for each, with commas")


def _together(codes: Sequence[int]) -> int:
    if 1 in codes:
        return 1
    return codes[0] if set(codes) in ({0}, {_ABSENT}) else _MIXED
