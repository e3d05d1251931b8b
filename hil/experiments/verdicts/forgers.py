"""What forgers show an auditor who holds a key as `mtm-onboard keygen` makes them, and what each could show elsewhere.

A forger knows the past motion's noise exactly, as no film shows it, and drives bodies without a plant's lag of its own.
`ATTACKS` has each forger with its control: the same doing where it must be read, or the attack would show nothing.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from datetime import date, timedelta
from functools import lru_cache

import numpy as np

from hil.plants.responses import Floats
from mtm_onboard.protocol import Channel, Codebook, Key, Scheme
from mtm_onboard.protocol.framing import Framing, channel_symbols
from mtm_onboard.protocol.holding import DayHolding, epoch_of_day
from mtm_onboard.protocol.keystream import SECRET_BYTES
from mtm_onboard.protocol.master import MasterHolding, new_master
from mtm_onboard.protocol.slots import slot_start_unix_s
from mtm_onboard.runtime.message import message_of

ERROR_S = 2.0
"""How far the film's time may be off: where both clocks are synchronised."""
PRELUDE_S = 1.0
"""How long a film runs before its slot begins."""
MONDAY = date(2026, 11, 30)
STREAM = 917
"""First word of the seeds of these experiments."""


def _robots(count: int, symbols: int) -> Scheme:
    channels = tuple(Channel(f"robot{n}", f"robot{n}", ("vx", "vy"), symbols, 0.1) for n in range(count))
    return Scheme(
        name="forgeries", rate_hz=20.0, band_hz=(0.5, 5.0), alphabet_size=16, message_ticks=20 * symbols,
        channels=channels, schedule="rolling", framing=Framing("integer", 8, check="tag", check_bits=24,
        code="reed-solomon"),
    )  # fmt: skip


ONE_ROBOT, TWO_ROBOTS = _robots(1, 10), _robots(2, 6)
"""Rolling, with a tag and a code, as default keys have them; as small as that goes, so that many can be tried."""
FIXED = replace(
    ONE_ROBOT, channels=(Channel("robot0", "robot0", ("vx", "vy"), 3, 0.1),), message_ticks=360, schedule="fixed",
    framing=None,
)  # fmt: skip
"""What keys of format 1 were: no window ever changes, and no tag is checked, so that each symbol needs evidence."""


@dataclass(frozen=True)
class Film:
    """What an auditor is shown: each robot's noise velocities by slot's tick, and when the film says that it began.

    `noise` has one (ticks, 2) array for each robot, from the slot's start on.
    """

    noise: tuple[Floats, ...]
    began_unix_s: float


@dataclass(frozen=True)
class Fleet:
    """A fleet on one Monday: its master or, under `FIXED`, its one secret; a slot of that day; a try's randomness."""

    holder: MasterHolding | bytes
    scheme: Scheme
    slot: int
    draw: np.random.Generator

    @property
    def master(self) -> MasterHolding:
        """What the fleet's files are cut from; TypeError under `FIXED`."""
        if isinstance(self.holder, bytes):
            raise TypeError("a fleet with one secret has no master")
        return self.holder

    @property
    def key(self) -> Key:
        """All that the fleet has."""
        return Key("fake-fleet", self.holder, self.scheme)

    @property
    def slot_s(self) -> float:
        """How long a slot takes."""
        return self.scheme.message_ticks / self.scheme.rate_hz

    def began_unix_s(self, slot: int) -> float:
        """When a film begins that shows a slot from its start."""
        return slot_start_unix_s(slot, self.scheme) - PRELUDE_S

    def payload(self) -> int:
        """Any number that a message may be."""
        return int(self.draw.integers(0, 256))

    def symbols(self, slot: int, payload: int) -> dict[str, tuple[int, ...]]:
        """Each channel's symbols of that message in that slot."""
        return channel_symbols(message_of(payload, self.key).symbols(slot), self.scheme)

    def sent(self, slot: int, payload: int) -> tuple[Floats, ...]:
        """What the robots play in a slot when they say that."""
        return played(self.key.codebook(slot), self.symbols(slot, payload))


def played(book: Codebook, symbols: dict[str, tuple[int, ...]]) -> tuple[Floats, ...]:
    """The noise of a whole slot of all channels in m/s, (ticks, axes) each."""
    return tuple(waveform(book, channel, symbols[channel.name]) for channel in book.scheme.channels)


def waveform(book: Codebook, channel: Channel, symbols: Sequence[int]) -> Floats:
    """The noise of a whole slot in m/s, (ticks, axes)."""
    parts = [book.samples(channel, window, [symbol])[0] for window, symbol in enumerate(symbols)]
    noise: Floats = np.array(channel.sigmas) * np.concatenate(parts, axis=1).T
    return noise


@lru_cache(maxsize=16)
def holder_of(number: int, scheme: Scheme) -> MasterHolding | bytes:
    """One of a few fleets' secrets, so that their trees need not be grown for every try."""
    secret = np.random.default_rng([STREAM, number]).bytes(SECRET_BYTES)
    if scheme.schedule == "fixed":
        return secret
    return replace(new_master("fake-fleet", scheme, MONDAY - timedelta(2), 6), master=secret)


def _now(fleet: Fleet, noise: tuple[Floats, ...]) -> Film:
    """A film of the fleet's slot."""
    return Film(noise, fleet.began_unix_s(fleet.slot))


def _honest(fleet: Fleet) -> Film:
    return _now(fleet, fleet.sent(fleet.slot, fleet.payload()))


def _splice(fleet: Fleet) -> Film:
    """Windows of four overheard messages, each put back where it was."""
    heard = [fleet.sent(fleet.slot - later, fleet.payload()) for later in (1, 2, 3, 4)]
    robots = []
    for number, channel in enumerate(fleet.scheme.channels):
        ticks = fleet.scheme.window_ticks(channel)
        chosen = fleet.draw.integers(0, len(heard), channel.symbols)
        parts = [heard[row][number][place * ticks : (place + 1) * ticks] for place, row in enumerate(chosen)]
        robots.append(np.concatenate(parts))
    return _now(fleet, tuple(robots))


def _journal(fleet: Fleet) -> Film:
    """A whole message of before, as a journal with waveforms would have it, on other bodies."""
    return _now(fleet, fleet.sent(fleet.slot - int(fleet.draw.integers(1, 200)), fleet.payload()))


def _learnt(fleet: Fleet) -> Film:
    """A codebook averaged from twenty overheard messages, of which a message is put together anew."""
    sums: dict[tuple[int, int], list[Floats]] = {}
    for later in range(1, 21):
        slot, payload = fleet.slot - later, fleet.payload()
        symbols = fleet.symbols(slot, payload)
        for number, (channel, noise) in enumerate(zip(fleet.scheme.channels, fleet.sent(slot, payload), strict=True)):
            ticks = fleet.scheme.window_ticks(channel)
            for place, symbol in enumerate(symbols[channel.name]):
                sums.setdefault((number, symbol), []).append(noise[place * ticks : (place + 1) * ticks])
    robots = []
    for number, channel in enumerate(fleet.scheme.channels):
        known = [symbol for robot, symbol in sums if robot == number]
        chosen = fleet.draw.choice(known, channel.symbols)
        parts = [np.mean(sums[number, int(symbol)], axis=0) for symbol in chosen]
        # As loud as the robots are.
        robots.append(np.concatenate([part * (np.array(channel.sigmas) / np.sqrt(np.mean(part**2))) for part in parts]))
    return _now(fleet, tuple(robots))


def _replay(fleet: Fleet) -> Film:
    """A slot played once more, hours or days later, as a robot would after a restart with an old clock."""
    later_slots = int(fleet.draw.integers(1, round(2 * 86_400 / fleet.slot_s)))
    return Film(fleet.sent(fleet.slot, fleet.payload()), fleet.began_unix_s(fleet.slot + later_slots))


def _relayed(late_s: tuple[float, float]) -> Callable[[Fleet], Film]:
    def relay(fleet: Fleet) -> Film:
        film = _honest(fleet)
        return replace(film, began_unix_s=film.began_unix_s + float(fleet.draw.uniform(*late_s)))

    return relay


def _tomorrow(fleet: Fleet) -> Film:
    """An auditor of Monday makes Tuesday's motion from Monday's secrets, by each derivation that Tuesday has."""
    epoch = epoch_of_day(MONDAY, fleet.scheme)
    monday = fleet.master.for_auditor(MONDAY, MONDAY)
    own = monday.day_secrets[epoch]
    guesses = (own, monday.tree.earlier(own, epoch + 2), monday.tree.day_secret(own, epoch + 1),
               monday.channel_secret(epoch, 0))  # fmt: skip
    tuesday = replace(monday.grant, first_day=MONDAY + timedelta(1), last_day=MONDAY + timedelta(1))
    guess = guesses[int(fleet.draw.integers(0, len(guesses)))]
    forger = replace(fleet, slot=fleet.slot + round(86_400 / fleet.slot_s))
    holding = DayHolding(tuesday, monday.tree, fleet.scheme, {epoch + 1: guess})
    return _by_auditor(forger, holding)


def _today(fleet: Fleet) -> Film:
    return _by_auditor(fleet, fleet.master.for_auditor(MONDAY, MONDAY))


def _by_auditor(fleet: Fleet, holding: DayHolding) -> Film:
    key = Key("fake-fleet", holding, fleet.scheme)
    symbols = channel_symbols(message_of(fleet.payload(), key).symbols(fleet.slot), fleet.scheme)
    return _now(fleet, played(key.codebook(fleet.slot), symbols))


def _another_robot(fleet: Fleet) -> Film:
    """A stolen robot plays its own channel on its body, and on the other what it can make up for the other's."""
    own = fleet.master.for_robot(["robot0"], MONDAY, MONDAY)
    key = Key("fake-fleet", own, fleet.scheme)
    symbols = channel_symbols(message_of(fleet.payload(), key).symbols(fleet.slot), fleet.scheme)
    first, second = fleet.scheme.channels
    epoch = epoch_of_day(MONDAY, fleet.scheme)
    made_up = (own.channel_secret(epoch, 0), own.tree.channel_secret(own.tag_key(epoch).secret, epoch, 1),
               own.tree.channel_secret(own.channel_secret(epoch, 0), epoch, 1))  # fmt: skip
    guess = Codebook(made_up[int(fleet.draw.integers(0, len(made_up)))], fleet.scheme, fleet.slot)
    book = key.codebook(fleet.slot)
    return _now(fleet, (waveform(book, first, symbols[first.name]), waveform(guess, second, symbols[second.name])))


@dataclass(frozen=True)
class Attack:
    """A forger under default keys, and its control with the scheme under which that must be read."""

    forge: Callable[[Fleet], Film]
    control: Callable[[Fleet], Film]
    scheme: Scheme = ONE_ROBOT
    control_scheme: Scheme = ONE_ROBOT


# The detector allows the plant 0.42 s of delay beyond the clocks' error.
_TOO_LATE_S, _IN_TIME_S = (ERROR_S + 0.5, ERROR_S + 60.5), (0.0, ERROR_S - 0.5)
ATTACKS: dict[str, Attack] = {
    "splice": Attack(_splice, _splice, control_scheme=FIXED),
    "journal": Attack(_journal, _journal, control_scheme=FIXED),
    "learnt codebook": Attack(_learnt, _learnt, control_scheme=FIXED),
    "replay": Attack(_replay, _honest),
    "relay": Attack(_relayed(_TOO_LATE_S), _relayed(_IN_TIME_S)),
    "Monday's auditor on Tuesday": Attack(_tomorrow, _today),
    "one robot as another": Attack(_another_robot, _honest, TWO_ROBOTS, TWO_ROBOTS),
}
"""Each attack by name."""
