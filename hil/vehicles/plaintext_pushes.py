"""The telemetry of a RoboMaster EP in plaintext: what is asked for, when it is due, and its text."""

from dataclasses import dataclass

from hil.vehicles.plaintext_grammar import PARSE_ERROR, RefusalError

RATES_HZ = (1, 5, 10, 20, 30, 50)

_DEFAULT_HZ = 5
_RATE_KEYS = {"position": "pfreq", "attitude": "afreq", "status": "sfreq"}
# A push that is due within this part of a period counts as due: instants are sums of decimal fractions.
_SLACK = 1e-6


@dataclass
class _Stream:
    """One attribute at one rate; pushes are counted from `since_s`."""

    rate_hz: int
    since_s: float
    last: int = 0

    def is_due(self, now_s: float) -> bool:
        number = int((now_s - self.since_s) * self.rate_hz + _SLACK)
        due = number > self.last
        self.last = number
        return due


class Pushes:
    """The attributes that are being pushed."""

    def __init__(self) -> None:
        self._streams: dict[str, _Stream] = {}

    def clear(self) -> None:
        """Push nothing more."""
        self._streams.clear()

    def request(self, words: tuple[str, ...], now_s: float) -> None:
        """Obey `position on pfreq 50 ...`; raises RefusalError, with nothing changed, when it makes no sense."""
        pairs = dict(zip(words[::2], words[1::2], strict=False))
        if not words or 2 * len(pairs) != len(words) or not set(pairs) <= {*_RATE_KEYS, *_RATE_KEYS.values(), "freq"}:
            raise RefusalError(PARSE_ERROR)
        rates = {key: _rate_hz(word) for key, word in pairs.items() if key not in _RATE_KEYS}
        wanted = {name: pairs[name] for name in _RATE_KEYS if name in pairs}
        if not wanted or not set(wanted.values()) <= {"on", "off"}:
            raise RefusalError(PARSE_ERROR)
        for name, switch in wanted.items():
            self._streams.pop(name, None)
            if switch == "on":
                rate_hz = rates.get("freq", rates.get(_RATE_KEYS[name], _DEFAULT_HZ))
                self._streams[name] = _Stream(rate_hz, now_s)

    def due(self, now_s: float) -> list[str]:
        """The attributes to push now, in the protocol's order; those that were missed are skipped."""
        return [name for name in _RATE_KEYS if name in self._streams and self._streams[name].is_due(now_s)]


def push_text(attributes: dict[str, str]) -> bytes:
    """One push of attributes and their numbers: `chassis push` once, a semicolon after each and one at the end."""
    return (
        "chassis push " + "".join(f"{name} {numbers}; " for name, numbers in attributes.items())[:-1] + ";"
    ).encode()


def _rate_hz(word: str) -> int:
    if word not in map(str, RATES_HZ):
        raise RefusalError(PARSE_ERROR)
    return int(word)
