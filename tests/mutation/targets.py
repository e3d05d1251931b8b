"""Which modules are mutated, and which tests have to notice."""

from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
_ONBOARD = "tests/onboard"
_FRAMING = f"{_ONBOARD}/protocol/framing"
_RUNTIME = f"{_ONBOARD}/runtime"


@dataclass(frozen=True)
class Target:
    """A module by its dotted name, and the test files that guard it, the quickest first."""

    module: str
    tests: tuple[str, ...]

    @property
    def source(self) -> Path:
        """The module's file."""
        return ROOT.joinpath(*self.module.split(".")).with_suffix(".py")


def _protocol(name: str, *tests: str) -> Target:
    return Target(f"mtm_onboard.protocol.{name}", tuple(f"{_ONBOARD}/protocol/{test}.py" for test in tests))


def _framing(name: str, *tests: str) -> Target:
    return Target(f"mtm_onboard.protocol.framing.{name}", tuple(f"{_FRAMING}/{test}.py" for test in tests))


def _runtime(name: str, *tests: str) -> Target:
    return Target(f"mtm_onboard.runtime.{name}", tuple(f"{_RUNTIME}/{test}.py" for test in tests))


TARGETS = (
    _runtime("guard", "test_guard", "test_tick", "test_failsafes"),
    _runtime("tick", "test_tick_link", "test_tick"),
    _runtime("loop", "test_loop"),
    _runtime("message", "test_message"),
    _protocol("keystream", "test_keystream", "test_waveform"),
    _protocol("waveform", "test_waveform", "test_spectrum"),
    _protocol("spectrum", "test_spectrum"),
    _protocol("codebook", "test_codebook", "test_spectrum"),
    _protocol("slots", "test_slots"),
    _framing("check", "test_check"),
    _framing("galois", "test_galois"),
    _framing("order", "test_order"),
    _framing("payload", "test_payload", "test_frame"),
    _framing("symbols", "test_symbols"),
    _framing("code", "test_code", "test_frame"),
    _framing("frame", "test_frame"),
    _protocol("scheme", "test_scheme", "test_spectrum"),
    _runtime("modulator", "test_modulator"),
)
