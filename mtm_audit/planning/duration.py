"""How long a recording must be for a key's scheme to be read with a wanted accuracy."""

import itertools
import math
from dataclasses import dataclass

from mtm_audit.planning.curve import Curve
from mtm_audit.planning.interval import message_interval
from mtm_audit.planning.search import curves_of
from mtm_audit.planning.table import AccuracyTable, members_of, pooled_name
from mtm_onboard.protocol.errors import MtmError, WrongValueError
from mtm_onboard.protocol.framing import payload_bits
from mtm_onboard.protocol.scheme import Scheme, count_bins

# With fewer, two candidates of a fixed schedule are often alike, and stay so in every repeat.
_FEW_TONES = 5


@dataclass(frozen=True)
class Duration:
    """How much motion to record. `repeats`: whole messages; `accuracy` and `interval` are those of all of them pooled.

    `from_start_s` suffices when the recording begins with a message; `anywhere_s` holds whole repeats of every window
    wherever in a message it begins. `beyond`: windows are longer than any measured, and the accuracy is that of the
    longest measured. `tones`: those of the shortest window where repeats play the same waveform again
    (fixed schedule), else 0.
    """

    repeats: int
    from_start_s: float
    anywhere_s: float
    accuracy: float
    interval: tuple[float, float]
    beyond: bool
    tones: int

    @property
    def repeats_gain_less(self) -> bool:
        """Whether the prediction is too high: the same few tones come again in every repeat."""
        return self.repeats > 1 and 0 < self.tones < _FEW_TONES


def required_duration(scheme: Scheme, table: AccuracyTable, bits: int, target_accuracy: float) -> Duration:
    """The shortest recording that has the target accuracy.

    r repeats of a window of t ticks count as one window of r t ticks, since detectors add up what repeats say;
    longer windows than the table has are taken to be as accurate as its longest. Error correction of the scheme's
    framing is not counted. Raises MtmError when the payload does not fit the key's scheme, when the table lacks its
    channels or alphabet, or when the longest windows of the table do not suffice.
    """
    if not 0.0 < target_accuracy < 1.0:
        raise WrongValueError(f"the target accuracy is {target_accuracy:g}; choose one above 0 and below 1")
    holds = payload_bits(scheme) if scheme.framing is None else scheme.framing.payload_bits
    if not 1 <= bits <= holds:
        raise MtmError(f"a payload of {bits} bits does not fit: a message of this key carries 1 to {holds} bits")
    parts = _parts(scheme, table)
    longest = max(scheme.window_ticks(channel) for channel in scheme.channels)
    for repeats in itertools.count(1):
        ticks = repeats * scheme.message_ticks
        windows = [ticks // count for _, count in parts]
        ends = [int(curve.window_ticks[-1]) for curve, _ in parts]
        known = [(curve, min(window, end), n) for (curve, n), window, end in zip(parts, windows, ends, strict=True)]
        if any(window < int(curve.window_ticks[0]) for curve, window, _ in known):
            continue
        accuracy = math.prod(curve.accuracy(window) ** count for curve, window, count in known)
        if accuracy >= target_accuracy:
            return Duration(
                repeats, ticks / scheme.rate_hz, (ticks + longest) / scheme.rate_hz, accuracy,
                message_interval(known), any(window > end for window, end in zip(windows, ends, strict=True)),
                _repeated_tones(scheme),
            )  # fmt: skip
        if all(window >= end for window, end in zip(windows, ends, strict=True)):
            break
    raise MtmError(
        f"the longest windows of the table give an accuracy of {accuracy:.3g}, not {target_accuracy:g}; lower the "
        "target, or measure longer windows"
    )


def _repeated_tones(scheme: Scheme) -> int:
    if scheme.schedule != "fixed":
        return 0
    return min(count_bins(scheme.window_ticks(channel), scheme.rate_hz, scheme.band_hz) for channel in scheme.channels)


def _parts(scheme: Scheme, table: AccuracyTable) -> tuple[tuple[Curve, int], ...]:
    curves = {
        frozenset(members_of(curve.channel)): curve
        for curve in curves_of(table, scheme.alphabet_size, measured_only=False)
    }
    names = [channel.name for channel in scheme.channels]
    if scheme.combine == "same" and len(names) > 1:
        wanted = [(pooled_name(names), scheme.message_symbols)]
    else:
        wanted = [(channel.name, channel.symbols) for channel in scheme.channels]
    for name, _ in wanted:
        if frozenset(members_of(name)) not in curves:
            known = ", ".join(table.channels)
            raise MtmError(
                f"the table has no {name} at M = {scheme.alphabet_size}, which this key uses; measure it (the table "
                f"has {known} at M = {', '.join(map(str, table.alphabet_sizes))})"
            )
    return tuple((curves[frozenset(members_of(name))], count) for name, count in wanted)
