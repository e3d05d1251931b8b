from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_onboard.model.velocity import BodyVelocity
from mtm_onboard.protocol import Channel, MtmError
from mtm_onboard.runtime.message import SILENCE, PlainMessage
from mtm_onboard.runtime.modulator import Modulator
from tests.onboard.schemes import small_codebook

BASE = BodyVelocity(0.3, -0.1, 0.5)


def played(modulator: Modulator, ticks) -> np.ndarray:
    rows = []
    for tick in ticks:
        rows.append(modulator.perturbation(tick).copy())
        modulator.prepare(tick)
    return np.array(rows)


def test_the_message_is_its_symbols_waveforms_in_a_row():
    book = small_codebook()
    channel = book.scheme.channel("b")
    expected = np.concatenate([book.samples(channel, window, [symbol])[0].T for window, symbol in enumerate((3, 0, 2))])
    assert np.array_equal(played(Modulator(book, "b", (3, 0, 2)), range(120)), expected)


def test_a_message_repeats_or_ends_in_silence():
    again = Modulator(small_codebook(), "b", (3, 0, 2))
    once = Modulator(small_codebook(), "b", (3, 0, 2), repeat=False)
    assert np.array_equal(played(again, range(120, 240)), played(again, range(120)))
    assert np.array_equal(played(once, range(120)), played(again, range(120)))
    assert not played(once, range(120, 400)).any()
    assert [tick for tick in range(-3, 200) if once.sends(tick)] == list(range(120))


@pytest.mark.parametrize("schedule", ["fixed", "rolling"])
def test_before_the_message_there_is_silence(schedule):
    modulator = Modulator(small_codebook(schedule=schedule), "a", (1,))
    assert not played(modulator, range(-130, 0)).any()
    assert modulator.add(-1, BASE) == BASE


@pytest.mark.parametrize("schedule", ["fixed", "rolling"])
def test_ticks_that_never_come_shift_nothing(schedule):
    whole = played(Modulator(small_codebook(schedule=schedule), "b", (3, 0, 2)), range(1200))
    kept = np.flatnonzero(np.random.default_rng(1).random(1200) < 0.3)
    # A stall over more than a window as well.
    kept = kept[(kept < 300) | (kept > 430)].tolist()
    assert np.array_equal(played(Modulator(small_codebook(schedule=schedule), "b", (3, 0, 2)), kept), whole[kept])


def test_a_rolling_schedule_plays_no_window_twice():
    book = small_codebook(schedule="rolling")
    windows = played(Modulator(book, "b", (3, 0, 2)), range(40 * 30)).reshape(30, 40)
    correlation = np.corrcoef(windows)
    assert np.max(np.abs(correlation - np.eye(30))) < 0.95
    assert np.array_equal(windows[7], book.samples(book.scheme.channel("b"), 7, [0])[0, 0])


@pytest.mark.parametrize("schedule", ["fixed", "rolling"])
def test_nothing_is_derived_in_the_tick_that_sends(schedule):
    book = small_codebook(schedule=schedule)
    modulator = Modulator(book, "b", (3, 0, 2))
    for tick in range(400):
        with patch.object(book, "samples", side_effect=AssertionError("derived while sending")):
            modulator.add(tick, BASE)
            modulator.perturbation(tick)
        modulator.prepare(tick)


def test_a_perturbation_is_a_view_that_nobody_can_write_to():
    modulator = Modulator(small_codebook(), "a", (1,))
    noise = modulator.perturbation(5)
    assert np.shares_memory(noise, modulator.perturbation(5))
    with pytest.raises(ValueError, match="read-only"):
        noise[0] = 1.0


def test_noise_has_the_scheme_s_sigma_on_the_channel_s_axes():
    modulator = Modulator(small_codebook(), "a", (1,))
    sent = np.array([modulator.add(tick, BASE) for tick in range(120)])
    noise = np.array([modulator.perturbation(tick) for tick in range(120)])
    assert sent[:, :2] - BASE[:2] == pytest.approx(0.1 * noise)
    assert np.all(sent[:, 2] == BASE.wz_radps)
    assert np.sqrt(np.mean((sent[:, :2] - BASE[:2]) ** 2, axis=0)) == pytest.approx([0.1, 0.1])


def test_a_gaussian_policy_takes_the_keyed_noise_for_its_own():
    modulator = Modulator(small_codebook(), "a", (1,))
    mean, sigma = np.array([0.2, -0.4]), np.array([0.5, 2.0])
    assert modulator.substitute(7, mean, sigma) == pytest.approx(mean + sigma * modulator.perturbation(7))


def test_a_channel_of_joints_serves_no_body_velocity():
    book = small_codebook(channels=(Channel("arm", "arm", ("shoulder", "elbow"), 1, 0.1),))
    modulator = Modulator(book, "arm", (1,))
    assert modulator.substitute(3, np.zeros(2), 1.0) == pytest.approx(modulator.perturbation(3))
    with pytest.raises(MtmError, match="shoulder, elbow"):
        modulator.add(3, BASE)


def changing(schedule: str, at_tick: int, ticks: int, **options) -> tuple[np.ndarray, int | None]:
    """What is played when (1, 1, 3) is queued before `at_tick`, and from which tick on it is."""
    modulator = Modulator(small_codebook(schedule=schedule), "b", (3, 0, 2), **options)
    before = played(modulator, range(-10, at_tick))
    queued = modulator.queue((1, 1, 3))
    after = played(modulator, range(at_tick, ticks))
    return np.concatenate([before, after])[10:], queued.start_tick(0.0)


@pytest.mark.parametrize("schedule", ["fixed", "rolling"])
@pytest.mark.parametrize(("at_tick", "boundary"), [(-5, 0), (0, 120), (1, 120), (119, 120), (120, 240), (230, 240)])
def test_a_queued_message_takes_effect_at_the_next_boundary(schedule, at_tick, boundary):
    book = small_codebook(schedule=schedule)
    one, other = (played(Modulator(book, "b", symbols), range(480)) for symbols in ((3, 0, 2), (1, 1, 3)))
    noise, start_tick = changing(schedule, at_tick, 480)
    assert start_tick == boundary
    assert np.array_equal(noise, np.concatenate([one[:boundary], other[boundary:]]))


@pytest.mark.parametrize("schedule", ["fixed", "rolling"])
def test_a_queued_message_that_ends_follows_and_leaves_silence(schedule):
    noise, start_tick = changing(schedule, 200, 600, repeat=False)
    assert start_tick == 240
    silent = ~noise.any(axis=1)
    assert [bool(silent[tick]) for tick in (119, 120, 239, 240, 359, 360, 599)] == [
        False, True, True, False, False, True, True,
    ]  # fmt: skip


@pytest.mark.parametrize("schedule", ["fixed", "rolling"])
@pytest.mark.parametrize("first", [(3, 0, 2), SILENCE])
def test_nothing_is_derived_while_sending_when_messages_change(schedule, first):
    book = small_codebook(schedule=schedule)
    modulator = Modulator(book, "b", first)
    changes = {50: (2, 1, 2), 119: (3, 1, 2), 200: SILENCE, 290: (0, 1, 2)}
    for tick in range(600):
        if tick in changes:
            modulator.queue(changes[tick])
        with patch.object(book, "samples", side_effect=AssertionError("derived while sending")):
            modulator.add(tick, BASE)
        modulator.prepare(tick)


@pytest.mark.parametrize("schedule", ["fixed", "rolling"])
def test_a_silent_run_speaks_from_the_boundary_until_silence(schedule):
    book = small_codebook(schedule=schedule)
    modulator = Modulator(book, "b", SILENCE)
    assert modulator.message is SILENCE
    assert not played(modulator, range(-10, 130)).any()
    assert modulator.add(60, BASE) is BASE
    sent = modulator.queue((3, 0, 2))
    assert not played(modulator, range(130, 240)).any()
    first = played(modulator, range(240, 400))
    ended = modulator.queue(SILENCE)
    rest = played(modulator, range(400, 900))
    assert (sent.start_tick(0.0), ended.start_tick(0.0)) == (240, 480)
    whole = played(Modulator(book, "b", (3, 0, 2)), range(480))
    assert np.array_equal(np.concatenate([first, rest[:80]]), whole[240:])
    assert not rest[80:].any()
    assert modulator.message is SILENCE


@pytest.mark.parametrize("schedule", ["fixed", "rolling"])
def test_a_stall_across_the_boundary_of_a_change_shifts_nothing(schedule):
    book = small_codebook(schedule=schedule)
    modulator = Modulator(book, "b", (3, 0, 2))
    played(modulator, range(60))
    modulator.queue((1, 1, 3))
    played(modulator, [60])
    other = played(Modulator(book, "b", (1, 1, 3)), range(400))
    assert np.array_equal(played(modulator, range(170, 400)), other[170:])


@given(
    st.sampled_from(["fixed", "rolling"]),
    st.integers(-200, 10),
    st.none() | st.just(SILENCE) | st.integers(0, 3),
    st.lists(st.tuples(st.integers(1, 90), st.none() | st.just(SILENCE) | st.integers(0, 3)), max_size=40),
)
def test_each_tick_has_its_own_message_s_noise_whatever_comes(schedule, tick, first, steps):
    book = small_codebook(schedule=schedule)
    channel = book.scheme.channel("a")
    first = SILENCE if first is None else first
    modulator = Modulator(book, "a", first if first is SILENCE else (first,))
    starts = {0: first}
    for step, symbol in steps:
        tick += step
        if symbol is not None:
            modulator.queue(symbol if symbol is SILENCE else (symbol,))
        message = max(0, tick // 120)
        symbol_now = starts[max(start for start in starts if start <= message)]
        silent = tick < 0 or symbol_now is SILENCE
        expected = np.zeros(2) if silent else book.samples(channel, message, [symbol_now])[0, :, tick % 120]
        assert modulator.sends(tick) is not silent
        assert np.array_equal(modulator.perturbation(tick), expected)
        modulator.prepare(tick)
        if symbol is not None:
            starts[max(0, tick // 120 + 1)] = symbol


def test_the_last_queued_before_a_boundary_is_played():
    book = small_codebook()
    modulator = Modulator(book, "a", (0,))
    first = modulator.queue((1,))
    played(modulator, range(10))
    assert (modulator.message, modulator.waiting) == ((0,), (1,))
    second, third = modulator.queue((2,)), modulator.queue((3,))
    played(modulator, range(10, 121))
    assert {one.start_tick(0.0) for one in (first, second, third)} == {120}
    assert [one.replaced for one in (first, second, third)] == [None, (1,), (2,)]
    assert (modulator.message, modulator.waiting) == ((3,), None)


def test_only_what_no_tick_has_taken_up_can_be_withdrawn():
    modulator = Modulator(small_codebook(), "a", (0,))
    queued = modulator.queue((1,))
    assert queued.start_tick(0.0) is None
    assert modulator.withdraw(queued)
    taken = modulator.queue((2,))
    played(modulator, [0])
    assert not modulator.withdraw(taken)
    assert not modulator.withdraw(queued)
    assert modulator.waiting == (2,)


def test_a_wrong_message_is_refused_and_the_present_goes_on():
    modulator = Modulator(small_codebook(), "a", (0,))
    with pytest.raises(MtmError, match="outside the alphabet"):
        modulator.queue((4,))
    with pytest.raises(MtmError, match="2 symbols given"):
        modulator.queue(PlainMessage((1, 2)))
    played(modulator, range(200))
    assert modulator.message == (0,)


def test_a_whole_message_gives_each_channel_its_part():
    book = small_codebook(schedule="rolling", first_slot=36_000 - 2)
    modulator = Modulator(book, "b", Counting())
    noise = played(modulator, range(120 * 5)).reshape(5, 3, 40)
    absolute, channel = small_codebook(schedule="rolling"), book.scheme.channel("b")
    for later in range(5):
        slot = 36_000 - 2 + later
        expected = [absolute.samples(channel, 3 * slot + place, [(slot + place) % 4])[0, 0] for place in range(3)]
        assert np.array_equal(noise[later], expected)


class Counting:
    """Other symbols in every slot: 0 for channel "a", and for "b" the slot's number counted on."""

    number = 0

    def symbols(self, slot: int) -> tuple[int, ...]:
        return (0, *((slot + place) % 4 for place in range(3)))


def test_a_wrong_channel_and_wrong_symbols_are_refused():
    with pytest.raises(MtmError, match="no channel 'c'"):
        Modulator(small_codebook(), "c", (1,))
    with pytest.raises(MtmError, match="sends 3 symbols a message, not 1"):
        Modulator(small_codebook(), "b", (1,))
    with pytest.raises(MtmError, match="choose 0 to 3"):
        Modulator(small_codebook(), "a", (4,))


def test_silence_is_a_view_that_nobody_can_write_to():
    modulator = Modulator(small_codebook(), "a", SILENCE)
    with pytest.raises(ValueError, match="read-only"):
        modulator.perturbation(5)[0] = 1.0


def test_whoever_asks_again_for_the_start_hears_it_again():
    modulator = Modulator(small_codebook(), "a", (0,))
    queued = modulator.queue((1,))
    played(modulator, [0])
    assert [queued.start_tick(0.0), queued.start_tick(0.0)] == [120, 120]


@pytest.mark.parametrize("axes", [("vx", "vy", "wz"), ("wz", "vx"), ("vy",)])
def test_noise_goes_to_the_axes_that_the_channel_names(axes):
    modulator = Modulator(small_codebook(channels=(Channel("a", "a", axes, 1, 0.1),)), "a", (1,))
    added = dict(zip(("vx", "vy", "wz"), np.subtract(modulator.add(9, BASE), BASE), strict=True))
    noise = dict(zip(axes, modulator.perturbation(9), strict=True))
    assert added == pytest.approx({axis: 0.1 * noise.get(axis, 0.0) for axis in ("vx", "vy", "wz")})


@pytest.mark.parametrize("schedule", ["fixed", "rolling"])
def test_a_message_is_asked_for_the_slot_in_which_it_begins(schedule):
    asked = []

    class Asked(Counting):
        def symbols(self, slot):
            asked.append(slot)
            return super().symbols(slot)

    modulator = Modulator(small_codebook(schedule=schedule, first_slot=100), "b", Asked())
    assert asked[0] == 100
    played(modulator, range(130))
    asked.clear()
    modulator.queue(Asked())
    assert asked == [102]


def test_between_windows_of_a_queued_message_the_loop_may_run():
    with patch("mtm_onboard.runtime.modulator.time.sleep") as sleep:
        modulator = Modulator(small_codebook(), "b", (3, 0, 2))
        assert sleep.call_args_list == []
        modulator.queue((1, 1, 3))
    assert [call.args for call in sleep.call_args_list] == [(0.001,)] * 3


def test_a_message_played_once_is_asked_for_no_later_slot():
    asked = []

    class Asked(Counting):
        def symbols(self, slot):
            asked.append(slot)
            return super().symbols(slot)

    played(Modulator(small_codebook(schedule="rolling"), "a", Asked(), repeat=False), range(300))
    assert set(asked) == {0}


def test_a_channel_of_body_axes_is_what_a_runtime_requires():
    Modulator(small_codebook(), "a", (1,)).require_body_axes()
    with pytest.raises(MtmError, match="only vx, vy, wz can be added"):
        Modulator(small_codebook(channels=(Channel("x", "x", ("vx", "lift"), 1, 0.1),)), "x", (1,)).require_body_axes()


@pytest.mark.parametrize(("schedule", "windows"), [("fixed", 3), ("rolling", 12)])
def test_each_window_is_computed_once(schedule, windows):
    book = small_codebook(schedule=schedule)
    with patch.object(book, "samples", wraps=book.samples) as samples:
        # Eleven windows of 40 ticks are begun, and the next is ready.
        played(Modulator(book, "b", (3, 0, 2)), range(-30, 420))
    assert samples.call_count == windows


def test_a_message_queued_before_the_start_is_ready_at_the_start():
    book = small_codebook(schedule="rolling")
    modulator = Modulator(book, "b", (3, 0, 2))
    for tick in range(-10, 130):
        if tick == -5:
            modulator.queue((1, 1, 3))
        with patch.object(book, "samples", side_effect=AssertionError("derived while sending")):
            modulator.add(tick, BASE)
        modulator.prepare(tick)


@pytest.mark.parametrize("schedule", ["fixed", "rolling"])
@pytest.mark.parametrize("symbol", [-1, 4])
def test_a_wrong_symbol_is_refused_before_it_waits(schedule, symbol):
    modulator = Modulator(small_codebook(schedule=schedule), "a", (0,))
    with pytest.raises(MtmError, match="choose 0 to 3"):
        modulator.queue((symbol,))
    with pytest.raises(MtmError, match="choose 0 to 3"):
        Modulator(small_codebook(schedule=schedule), "a", (symbol,))
    played(modulator, range(130))
    assert modulator.message == (0,)


def test_a_slot_s_symbols_are_asked_for_once():
    asked = []

    class Asked(Counting):
        def symbols(self, slot):
            asked.append(slot)
            return super().symbols(slot)

    modulator = Modulator(small_codebook(schedule="rolling"), "b", Asked())
    asked.clear()
    # The first window of slot 4 is ready before slot 3 ends.
    played(modulator, range(470))
    assert asked == [1, 2, 3, 4]
