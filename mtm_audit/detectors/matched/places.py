"""What all codebooks share at the coarse rates of a search: what was heard there, and the hypotheses near them."""

from dataclasses import dataclass

from mtm_audit.detectors.matched.correlate import Heard, Prepared, hear
from mtm_audit.detectors.matched.hypotheses import Grid, make_grid
from mtm_audit.detectors.matched.motion import Motion
from mtm_audit.detectors.matched.rates import Rates
from mtm_audit.model.timing import Onset
from mtm_audit.model.track import Floats
from mtm_onboard.protocol.codebook import Codebook
from mtm_onboard.protocol.scheme import Channel


@dataclass(frozen=True, kw_only=True)
class Places:
    """A motion and the coarse rates `rates_hz` (rates,), by their numbers; of `codebook` only the scheme matters.

    `lead` cells precede the recording; `windows` have waveforms of their own.
    """

    prepared: Prepared
    codebook: Codebook
    channel: Channel
    rates_hz: Floats
    lead: int
    windows: int
    onset: Onset

    @property
    def motion(self) -> Motion:
        """The motion that is searched."""
        return self.prepared.motion

    @property
    def rates(self) -> Rates:
        """The coarse rates by their numbers."""
        nominal_hz = self.codebook.scheme.rate_hz
        return Rates(len(self.rates_hz), float(self.rates_hz[1] - self.rates_hz[0]) / nominal_hz, nominal_hz)

    def heard(self, coarse: int) -> Heard:
        """The motion correlated at one of them."""
        return hear(self.prepared, self.codebook, self.channel, float(self.rates_hz[coarse]), self.lead)

    def grid(self, coarse: int, wide: int = 1) -> Grid:
        """The hypotheses at the rates of so many coarse ones around one of them."""
        rates, ticks = self.rates, self.codebook.scheme.window_ticks(self.channel)
        return make_grid(
            self.motion,
            rates.nominal_hz,
            float(self.rates_hz[coarse]),
            wide * rates.spacing,
            ticks,
            self.lead,
            self.windows,
            self.onset,
        )
