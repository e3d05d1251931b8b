"""The codebook: all waveforms of a key and a scheme, computed only when asked for."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from mtm_onboard.protocol.errors import MtmError
from mtm_onboard.protocol.holding import Secret, holding_of
from mtm_onboard.protocol.keystream import SECRET_BYTES
from mtm_onboard.protocol.scheme import Channel, Scheme
from mtm_onboard.protocol.slots import epoch_of_slot
from mtm_onboard.protocol.waveform import (
    Complexes,
    Floats,
    channel_tones,
    draw_alphabet,
    evaluate_window,
    phasors,
    tone_bins,
)


class Codebook:
    """Waveforms of a secret, or of what a key file holds, under one scheme.

    A channel's windows count from the first one of message slot `first_slot`, see `slots`; under the fixed schedule
    every message has the same waveforms and the slot does not matter.
    """

    def __init__(self, secret: Secret, scheme: Scheme, first_slot: int = 0) -> None:
        if isinstance(secret, bytes) and len(secret) != SECRET_BYTES:
            raise MtmError(f"a secret has {SECRET_BYTES} bytes, not {len(secret)}; make one with mtm-onboard keygen")
        self._holding = holding_of(secret)
        self.scheme = scheme
        self.first_slot = first_slot

    def __repr__(self) -> str:
        return f"Codebook(scheme={self.scheme.name!r}, first_slot={self.first_slot})"

    @property
    def last_slot(self) -> int | None:
        """The last message slot that the key is for; None when there is no last one."""
        grant = self._holding.grant
        return None if grant is None else grant.last_slot(self.scheme)

    def bins(self, channel: Channel) -> NDArray[np.int64]:
        """In-band bins of the channel's window, shape (K,)."""
        return tone_bins(self.scheme.window_ticks(channel), self.scheme.rate_hz, self.scheme.band_hz)

    def tone_powers(self, channel: Channel) -> Floats:
        """Mean power of each tone beside that of an even share, (K,): of mean 1, and 1 each without a spectrum."""
        return channel_tones(self.scheme, channel)[1]

    def tones(self, channel: Channel, window: int, symbols: Sequence[int] | None = None) -> Complexes:
        """Complex tones of the asked symbols (all M when None): shape (symbols, axes, K), see `waveform.phasors`.

        A spectrum multiplies each tone by the root of its power, the same for all symbols.

        `window` counts this channel's windows from the first one of `first_slot`. Raises MtmError for a symbol
        outside the alphabet and, under the rolling schedule, for a window before the Unix epoch or of a day or channel
        that the key is not for.
        """
        scheme = self.scheme
        asked = range(scheme.alphabet_size) if symbols is None else symbols
        epoch, played = self._place(channel, window)
        secret = self._holding.channel_secret(epoch, scheme.channel_number(channel))
        first_axis = scheme.axis_index(channel)
        count = len(self.bins(channel))
        wrong = next((symbol for symbol in asked if not 0 <= symbol < scheme.alphabet_size), None)
        if wrong is not None:
            raise MtmError(f"symbol {wrong} is outside the alphabet; choose 0 to {scheme.alphabet_size - 1}")
        axes = range(first_axis, first_axis + len(channel.axes))
        flat = phasors(*draw_alphabet(secret, epoch, played, asked, axes, count), scheme.power)
        return flat if scheme.spectrum is None else flat * np.sqrt(self.tone_powers(channel))

    def samples(self, channel: Channel, window: int, symbols: Sequence[int] | None = None) -> Floats:
        """Unit-variance waveforms at the window's whole ticks: shape (symbols, axes, window_ticks).

        Under power = "window" with a spectrum a window's mean square is 1 on the average over the key.
        """
        tones = self.tones(channel, window, symbols)
        return evaluate_window(tones, self.bins(channel), self.scheme.window_ticks(channel))

    def _place(self, channel: Channel, window: int) -> tuple[int, int]:
        """Epoch and window number under which the keyed stream has this window."""
        if self.scheme.schedule == "fixed":
            return self.scheme.epoch, 0
        later, place = divmod(window, channel.symbols)
        epoch, slot = epoch_of_slot(self.first_slot + later, self.scheme)
        return epoch, slot * channel.symbols + place
