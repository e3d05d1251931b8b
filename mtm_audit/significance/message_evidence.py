"""Evidence for a message and for each of its symbols, by e-values over the key.

Hypotheses say at which timing, through which plant, with which gains a waveform reached the recording, and have prior
probabilities that were fixed before. A mixture of e-values with such weights is one, leaving terms out only lowers it,
and so the terms may be chosen in any way. Two mixtures are made: `presence`, and `symbol_evidence` for each position.

docs/evidence.md has the theorem, and what is random and what is fixed in it.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from mtm_audit.significance.channel_terms import ChannelTerms
from mtm_audit.significance.presence import channel_nats, presence
from mtm_audit.significance.symbol_evidence import SymbolEvidence, weigh_symbol
from mtm_audit.significance.weighed_channel import WeighedChannel, weighed


@dataclass(frozen=True)
class MessageEvidence:
    """`presence_nats`: log e-value of any message of the key; `channels_nats`: of each channel by itself, by its name;
    `symbols`: by message position, None where no channel shows it or it was not weighed.
    """

    presence_nats: float
    channels_nats: dict[str, float]
    symbols: tuple[SymbolEvidence | None, ...]

    def discounted(self, nats: float) -> "MessageEvidence":
        """The same where this was one of several hypotheses, whose log prior probability is `-nats`."""
        symbols = (None if item is None else SymbolEvidence(item.symbol, item.nats - nats) for item in self.symbols)
        channels = {name: value - nats for name, value in self.channels_nats.items()}
        return MessageEvidence(self.presence_nats - nats, channels, tuple(symbols))


def weigh_message(
    channels: Sequence[ChannelTerms], costs: Sequence[float], positions: int, *, symbols_above_nats: float = -math.inf
) -> MessageEvidence:
    """What the channels that could be read say together of a message of so many positions.

    Channels of one name are parts of one, the one that shows most first. `costs` are log prior probabilities of the
    track that was chosen for each. Symbols are weighed where presence is more than `symbols_above_nats`.
    """
    own = [weighed(channel, cost) for channel, cost in zip(channels, costs, strict=True)]
    parts: dict[str, list[WeighedChannel]] = {}
    for item in own:
        parts.setdefault(item.channel.name, []).append(item)
    nats = {name: channel_nats(each) for name, each in parts.items()}
    present = presence(list(parts.values()), list(nats.values()))
    found: list[SymbolEvidence | None] = [None] * positions
    for position in range(positions if present > symbols_above_nats else 0):
        showing = [row for row, channel in enumerate(channels) if position in channel.shown]
        if showing:
            found[position] = weigh_symbol(own, showing, position)
    return MessageEvidence(present, nats, tuple(found))
