"""Forgeries against keys as `mtm-onboard keygen` makes them, by forgers who know all that they could have come by.

A forger knows the past motion's noise exactly, as no film shows it, and drives bodies without a plant's lag of its own.
Each try is a film that an auditor of its day decodes. `honest` is the control: robots with their own files, which must
be authenticated, or the others would show nothing.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, date, datetime, timedelta
from functools import lru_cache

import numpy as np

from hil.experiments.runs.cells import Cell, Scalar, Values
from hil.plants.responses import Floats, lag
from mtm_audit.decoding.decode import decode_tracks
from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.model.recorded_at import RecordedAt
from mtm_audit.model.track import Track
from mtm_audit.reporting.basis import basis_of
from mtm_onboard.protocol import Channel, Codebook, Key, MtmError, Scheme
from mtm_onboard.protocol.framing import Framing, channel_symbols
from mtm_onboard.protocol.holding import DayHolding, epoch_of_day
from mtm_onboard.protocol.keystream import SECRET_BYTES
from mtm_onboard.protocol.master import MasterHolding, new_master
from mtm_onboard.protocol.slots import slot_at, slot_start_unix_s
from mtm_onboard.runtime.message import message_of

HONEST = "honest"
COUNTS = ("tries", "decoded", "authenticated", "inconclusive", "absent", "refused")
"""What is counted of each attack; refused are films that could not be read at all."""
ERROR_S = 2.0
"""How far the film's time may be off: where both clocks are synchronised."""
_STEP_S = 0.02
_PRELUDE_S, _FILM_S = 1.0, 14.0
_LAG_S, _SLIP_MPS, _NOISE_M = 0.1, 0.02, 0.0005
_STREAM = 917
_PER_CELL = 5
MONDAY = date(2026, 11, 30)
SCHEME = Scheme(
    name="forgeries", rate_hz=50.0, band_hz=(0.5, 5.0), alphabet_size=16, message_ticks=600,
    channels=tuple(Channel(f"robot{number}", f"robot{number}", ("vx", "vy"), 6, 0.1) for number in range(2)),
    schedule="rolling", framing=Framing("integer", 8, check="tag", check_bits=24, code="reed-solomon"),
)  # fmt: skip
_SLOT_S = SCHEME.message_ticks / SCHEME.rate_hz


@dataclass(frozen=True)
class Film:
    """What an auditor is shown: each robot's noise velocities by slot's tick, and when the film says that it began.

    `noise` has one (ticks, 2) array for each robot, from the slot's start on.
    """

    noise: tuple[Floats, ...]
    began_unix_s: float


@dataclass(frozen=True)
class Fleet:
    """A fleet of two robots on one Monday: its master, a slot of that day, and the randomness of one try."""

    master: MasterHolding
    slot: int
    draw: np.random.Generator

    @property
    def start_unix_s(self) -> float:
        """When the slot begins."""
        return slot_start_unix_s(self.slot, SCHEME)

    def payload(self) -> int:
        """Any number that a message may be."""
        return int(self.draw.integers(0, 256))

    def sent(self, slot: int, payload: int) -> tuple[Floats, ...]:
        """What both robots play in a slot when they say that."""
        key = Key("fake-fleet", self.master, SCHEME)
        symbols = channel_symbols(message_of(payload, key).symbols(slot), SCHEME)
        book = key.codebook(slot)
        return tuple(waveform(book, channel, symbols[channel.name]) for channel in SCHEME.channels)


def waveform(book: Codebook, channel: Channel, symbols: Sequence[int]) -> Floats:
    """The noise of a whole slot in m/s, (ticks, axes)."""
    parts = [book.samples(channel, window, [symbol])[0] for window, symbol in enumerate(symbols)]
    played: Floats = channel.sigma * np.concatenate(parts, axis=1).T
    return played


def forgery_cells(tries: int, first_seed: int) -> list[Cell]:
    """Cells of every attack in turn, with `tries` in total at least, and as many of the control as of one attack."""
    names = [HONEST, *ATTACKS]
    each = -(-tries // (len(ATTACKS) * _PER_CELL))
    return [
        Cell("forgeries", {"attack": name, "tries": _PER_CELL}, first_seed + number)
        for number in range(each)
        for name in names
    ]


def try_forgeries(parameters: Values, seed: int) -> dict[str, Scalar]:
    """How many films of one attack were decoded, authenticated, inconclusive, absent, or refused."""
    counts = dict.fromkeys(COUNTS, 0)
    for number in range(int(parameters["tries"])):
        counts["tries"] += 1
        for result in one_try(str(parameters["attack"]), seed * 1000 + number):
            counts[result] += 1
    return dict(counts)


def one_try(attack: str, seed: int) -> tuple[str, ...]:
    """The verdict on one film, and "authenticated" where its tag holds."""
    draw = np.random.default_rng([_STREAM, sorted([HONEST, *ATTACKS]).index(attack), seed])
    at_s = datetime(2026, 11, 30, 1, tzinfo=UTC).timestamp() + float(draw.uniform(0.0, 22 * 3600.0))
    fleet = Fleet(_master(int(draw.integers(0, 4))), slot_at(at_s, SCHEME), draw)
    film = _honest(fleet) if attack == HONEST else ATTACKS[attack](fleet)
    day = datetime.fromtimestamp(film.began_unix_s, UTC).date()
    auditor = Key("fake-fleet", fleet.master.for_auditor(day, day), SCHEME)
    tracks = [_filmed(channel.body, noise, draw) for channel, noise in zip(SCHEME.channels, film.noise, strict=True)]
    try:
        decoding = decode_tracks(tracks, auditor, DecodeSettings(at=RecordedAt(film.began_unix_s, ERROR_S)))
    except MtmError:
        return ("refused",)
    held = decoding.verdict == "decoded" and decoding.frames[-1].message.authenticated
    # What the report calls authenticated, which also asks whether each robot was heard.
    authentic = held and basis_of(decoding, auditor.holding.grant, None).authenticates
    return (decoding.verdict, "authenticated") if authentic else (decoding.verdict,)


@lru_cache(maxsize=4)
def _master(number: int) -> MasterHolding:
    secret = np.random.default_rng([_STREAM, number]).bytes(SECRET_BYTES)
    return replace(new_master("fake-fleet", SCHEME, MONDAY - timedelta(2), 6), master=secret)


def _filmed(name: str, noise: Floats, draw: np.random.Generator) -> Track:
    """A body that begins to play a second after the film does, again and again, as motion capture sees it."""
    times_s = np.arange(round(_FILM_S / _STEP_S), dtype=np.float64) * _STEP_S
    ticks = np.floor((times_s - _PRELUDE_S) * SCHEME.rate_hz + 1e-6).astype(np.int64)
    played = np.where(
        (ticks >= 0)[:, None] & (ticks < len(noise))[:, None], noise[np.clip(ticks, 0, len(noise) - 1)], 0.0
    )
    task = 0.3 * np.cos(2.0 * np.pi * (times_s[:, None] * draw.uniform(0.03, 0.1, 2) + draw.random(2)))
    slip = _SLIP_MPS * draw.standard_normal(played.shape)
    velocities = lag(_STEP_S, _LAG_S).advance(played + task) + slip
    positions = np.cumsum(velocities, axis=0) * _STEP_S + _NOISE_M * draw.standard_normal(played.shape)
    return Track(name, times_s, positions, np.ones(len(times_s), dtype=np.bool_))


def _now(fleet: Fleet, noise: tuple[Floats, ...]) -> Film:
    """A film of the fleet's slot."""
    return Film(noise, fleet.start_unix_s - _PRELUDE_S)


def _honest(fleet: Fleet) -> Film:
    return _now(fleet, fleet.sent(fleet.slot, fleet.payload()))


def _splice(fleet: Fleet) -> Film:
    """Windows of four overheard messages, each put back where it was."""
    heard = [fleet.sent(fleet.slot - later, fleet.payload()) for later in (1, 2, 3, 4)]
    robots = []
    for number, channel in enumerate(SCHEME.channels):
        ticks = SCHEME.window_ticks(channel)
        chosen = fleet.draw.integers(0, len(heard), channel.symbols)
        parts = [heard[row][number][place * ticks : (place + 1) * ticks] for place, row in enumerate(chosen)]
        robots.append(np.concatenate(parts))
    return _now(fleet, tuple(robots))


def _journal(fleet: Fleet) -> Film:
    """A whole message of before, as a journal with waveforms would have it, on other bodies."""
    return _now(fleet, fleet.sent(fleet.slot - int(fleet.draw.integers(1, 200)), fleet.payload()))


def _learnt(fleet: Fleet) -> Film:
    """A codebook averaged from twenty overheard messages, of which a message is put together anew."""
    key = Key("fake-fleet", fleet.master, SCHEME)
    sums: dict[tuple[int, int], list[Floats]] = {}
    for later in range(1, 21):
        slot, payload = fleet.slot - later, fleet.payload()
        symbols = channel_symbols(message_of(payload, key).symbols(slot), SCHEME)
        for number, (channel, noise) in enumerate(zip(SCHEME.channels, fleet.sent(slot, payload), strict=True)):
            ticks = SCHEME.window_ticks(channel)
            for place, symbol in enumerate(symbols[channel.name]):
                sums.setdefault((number, symbol), []).append(noise[place * ticks : (place + 1) * ticks])
    robots = []
    for number, channel in enumerate(SCHEME.channels):
        known = [symbol for robot, symbol in sums if robot == number]
        chosen = fleet.draw.choice(known, channel.symbols)
        parts = [np.mean(sums[number, int(symbol)], axis=0) for symbol in chosen]
        # As loud as the robots are.
        robots.append(np.concatenate([part * (channel.sigma / np.sqrt(np.mean(part**2))) for part in parts]))
    return _now(fleet, tuple(robots))


def _replay(fleet: Fleet) -> Film:
    """A slot played once more, hours or days later, as a robot would after a restart with an old clock."""
    later_slots = int(fleet.draw.integers(1, round(2 * 86_400 / _SLOT_S)))
    began_s = slot_start_unix_s(fleet.slot + later_slots, SCHEME) - _PRELUDE_S
    return Film(fleet.sent(fleet.slot, fleet.payload()), began_s)


def _relay(fleet: Fleet) -> Film:
    """The motion of now, shown so much later that the stated window is over."""
    # The detector allows the plant 0.42 s of delay beyond the clocks' error.
    late_s = ERROR_S + 0.5 + float(fleet.draw.uniform(0.0, 60.0))
    return Film(fleet.sent(fleet.slot, fleet.payload()), fleet.start_unix_s - _PRELUDE_S + late_s)


def _tomorrow(fleet: Fleet) -> Film:
    """An auditor of Monday makes Tuesday's motion from Monday's secrets, by each derivation that Tuesday has."""
    epoch = epoch_of_day(MONDAY, SCHEME)
    monday = fleet.master.for_auditor(MONDAY, MONDAY)
    own = monday.day_secrets[epoch]
    guesses = (own, monday.tree.earlier(own, epoch + 2), monday.tree.day_secret(own, epoch + 1),
               monday.channel_secret(epoch, 0))  # fmt: skip
    tuesday = replace(monday.grant, first_day=MONDAY + timedelta(1), last_day=MONDAY + timedelta(1))
    guess = guesses[int(fleet.draw.integers(0, len(guesses)))]
    key = Key("fake-fleet", DayHolding(tuesday, monday.tree, SCHEME, {epoch + 1: guess}), SCHEME)
    slot = fleet.slot + round(86_400 / _SLOT_S)
    symbols = channel_symbols(message_of(fleet.payload(), key).symbols(slot), SCHEME)
    book = key.codebook(slot)
    noise = tuple(waveform(book, channel, symbols[channel.name]) for channel in SCHEME.channels)
    return Film(noise, slot_start_unix_s(slot, SCHEME) - _PRELUDE_S)


def _another_robot(fleet: Fleet) -> Film:
    """A stolen robot plays its own channel on both bodies, and what it can make up for the other's."""
    own = fleet.master.for_robot(["robot0"], MONDAY, MONDAY)
    key = Key("fake-fleet", own, SCHEME)
    symbols = channel_symbols(message_of(fleet.payload(), key).symbols(fleet.slot), SCHEME)
    first, second = SCHEME.channels
    epoch = epoch_of_day(MONDAY, SCHEME)
    made_up = (own.channel_secret(epoch, 0), own.tree.channel_secret(own.tag_key(epoch).secret, epoch, 1),
               own.tree.channel_secret(own.channel_secret(epoch, 0), epoch, 1))  # fmt: skip
    guess = Codebook(made_up[int(fleet.draw.integers(0, len(made_up)))], SCHEME, fleet.slot)
    return _now(
        fleet,
        (waveform(key.codebook(fleet.slot), first, symbols[first.name]), waveform(guess, second, symbols[second.name])),
    )


ATTACKS: dict[str, Callable[[Fleet], Film]] = {
    "splice": _splice,
    "journal": _journal,
    "learnt codebook": _learnt,
    "replay": _replay,
    "relay": _relay,
    "Monday's auditor on Tuesday": _tomorrow,
    "one robot as another": _another_robot,
}
"""Each attack by name, and how its film is made."""
