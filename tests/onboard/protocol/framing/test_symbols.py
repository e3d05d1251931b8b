import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_onboard.protocol import Channel, MtmError, Scheme
from mtm_onboard.protocol.framing import (
    channel_symbols,
    check_symbols,
    number_of_symbols,
    payload_bits,
    symbols_of_number,
)


def split(alphabet_size, counts):
    channels = tuple(Channel(f"c{n}", "b", ("vx",), count, 0.1) for n, count in enumerate(counts))
    ticks = 100 * 60
    return Scheme(
        name="t", rate_hz=50.0, band_hz=(0.5, 5.0), alphabet_size=alphabet_size, message_ticks=ticks, channels=channels
    )


@given(st.integers(2, 65_536), st.lists(st.sampled_from([1, 2, 3, 4, 5]), min_size=1, max_size=5), st.data())
def test_every_number_survives_the_way_through_the_channels(alphabet_size, counts, data):
    scheme = split(alphabet_size, counts)
    number = data.draw(st.integers(0, 2 ** payload_bits(scheme) - 1))
    symbols = symbols_of_number(number, scheme)
    parts = channel_symbols(symbols, scheme)
    assert [len(parts[channel.name]) for channel in scheme.channels] == counts
    assert (
        number_of_symbols([symbol for channel in scheme.channels for symbol in parts[channel.name]], scheme) == number
    )


def test_four_channels_of_two_bits_carry_a_byte():
    scheme = split(4, [1, 1, 1, 1])
    assert payload_bits(scheme) == 8
    assert symbols_of_number(0b11_10_01_00, scheme) == (3, 2, 1, 0)


def test_a_number_that_does_not_fit_is_refused_with_the_limit():
    with pytest.raises(MtmError, match="8 bits, 0 to 255"):
        symbols_of_number(256, split(4, [1, 1, 1, 1]))


def test_symbols_that_spell_no_message_are_recognised():
    scheme = split(3, [2])  # nine pairs, three bits
    assert number_of_symbols((2, 2), scheme) is None


def test_in_the_same_mode_every_channel_plays_the_whole_message():
    channels = (Channel("x", "b", ("vx",), 2, 0.1), Channel("y", "b", ("vy",), 2, 0.1))
    scheme = Scheme(
        name="t",
        rate_hz=50.0,
        band_hz=(0.5, 5.0),
        alphabet_size=4,
        message_ticks=600,
        channels=channels,
        combine="same",
    )
    assert channel_symbols((1, 3), scheme) == {"x": (1, 3), "y": (1, 3)}
    with pytest.raises(MtmError, match="3 symbols given"):
        channel_symbols((1, 2, 3), scheme)


@pytest.mark.parametrize("symbol", [-1, 4])
def test_symbols_outside_the_alphabet_are_refused(symbol):
    scheme = split(4, [1, 1])
    assert check_symbols([0, 3], scheme) == (0, 3)
    with pytest.raises(MtmError, match=f"symbol {symbol} is outside the alphabet; choose 0 to 3"):
        check_symbols([0, symbol], scheme)


def test_numbers_fill_whole_bits_and_no_more():
    scheme = split(3, [2])
    assert payload_bits(scheme) == 3
    assert symbols_of_number(7, scheme) == (2, 1)
    assert number_of_symbols((2, 1), scheme) == 7
    for number in (-1, 8):
        with pytest.raises(MtmError, match="3 bits, 0 to 7"):
            symbols_of_number(number, scheme)
