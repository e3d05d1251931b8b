import json
import tomllib
from dataclasses import asdict, replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from mtm_onboard.protocol import Channel, MtmError, Scheme
from mtm_onboard.protocol.framing import Framing
from mtm_onboard.protocol.scheme import count_bins, scheme_from_table, shortest_window
from mtm_onboard.protocol.schemefile import scheme_text
from tests.onboard.protocol.framing.framed import framed_scheme
from tests.onboard.schemes import small_scheme

FRAMED = framed_scheme(Framing("integer", 8, check="tag", check_bits=16))


def one_channel(**changes) -> Scheme:
    """One symbol of 120 ticks on one axis; `changes` are the scheme's, and `channel` its channel's."""
    channel = Channel("a", "a", ("vx",), 1, 0.1)
    return small_scheme(channels=(replace(channel, **changes.pop("channel", {})),), **changes)


def table_of(scheme: Scheme) -> dict:
    return tomllib.loads(scheme_text(scheme))["scheme"]


def refused(says: str, **changes) -> None:
    with pytest.raises(MtmError, match=says):
        one_channel(**changes)


def test_windows_axes_and_positions_follow_from_the_channels():
    scheme = small_scheme(channels=(*small_scheme().channels, Channel("c", "c", ("vx",), 2, 0.1)))
    a, b, c = scheme.channels
    assert [scheme.window_ticks(channel) for channel in (a, b, c)] == [120, 40, 60]
    assert [scheme.axis_index(channel) for channel in (a, b, c)] == [0, 2, 3]
    assert [scheme.first_position(channel) for channel in (a, b, c)] == [0, 1, 4]
    assert scheme.message_symbols == 6
    assert scheme.channel("b") is b
    with pytest.raises(MtmError, match="no channel 'd'; choose one of: a, b, c"):
        scheme.channel("d")


def test_channels_that_say_the_same_begin_with_one_symbol():
    scheme = small_scheme(
        channels=(Channel("a", "a", ("vx",), 3, 0.1), Channel("b", "b", ("vx",), 3, 0.1)), combine="same"
    )
    assert [scheme.first_position(channel) for channel in scheme.channels] == [0, 0]
    assert scheme.message_symbols == 3


# A changed fingerprint would make every key that is out there another scheme's.
def test_fingerprints_stay_what_they_are():
    assert small_scheme().fingerprint == "398bcbf7d247e261"
    assert framed_scheme(Framing("integer", 8)).fingerprint == "4add54ec490c0f32"


def test_a_fingerprint_differs_with_every_field_of_the_framing():
    framings = [
        None, Framing("integer", 8), Framing("bytes", 8), Framing("integer", 9), Framing("integer", 8, number_bits=1),
        Framing("integer", 8, check="crc", check_bits=16), Framing("integer", 8, check="tag", check_bits=16),
        Framing("integer", 8, code="reed-solomon"), Framing("integer", 8, interleave=True),
    ]  # fmt: skip
    prints = {framed_scheme(framing).fingerprint for framing in framings}
    assert len(prints) == len(framings)
    assert all(len(one) == 16 and int(one, 16) >= 0 for one in prints)


@pytest.mark.parametrize("scheme", [small_scheme(), FRAMED], ids=["plain", "framed"])
def test_a_scheme_survives_its_table(scheme):
    assert scheme_from_table(table_of(scheme)) == scheme


@pytest.mark.parametrize("name", ["name", "rate_hz", "band_hz", "alphabet_size", "message_ticks", "channels"])
def test_a_table_without_a_needed_field_is_refused_by_name(name):
    table = table_of(FRAMED)
    del table[name]
    with pytest.raises(MtmError, match=f"the scheme lacks {name}; add it"):
        scheme_from_table(table)


@pytest.mark.parametrize("name", ["combine", "pooling", "power", "schedule", "epoch", "framing", "spectrum"])
def test_a_table_without_an_optional_field_has_its_default(name):
    table = table_of(replace(FRAMED, spectrum=((2.0, 0.0), (20.0, -6.0))))
    del table[name]
    defaults = dict(
        combine="split", pooling="mean", power="window", schedule="fixed", epoch=0, framing=None, spectrum=None
    )
    assert getattr(scheme_from_table(table), name) == defaults[name]


@pytest.mark.parametrize(
    ("change", "says"),
    [
        ({"version": 2}, "of version 2, this program reads 1"),
        ({"version": None}, "of version None"),
        ({"colour": 1}, "the scheme has an unknown field 'colour'"),
        ({"channels": 3}, "must be a list of tables"),
        ({"channels": [3]}, "must be a list of tables"),
        ({"channels": []}, "has no channel"),
        ({"band_hz": [1.0]}, "must be two numbers"),
        ({"band_hz": [1.0, 2.0, 3.0]}, "must be two numbers"),
        ({"band_hz": 3.0}, "must be two numbers"),
        ({"framing": 3}, "framing must be a table"),
        ({"framing": {"payload": "integer"}}, "framing lacks payload_bits; add it"),
        ({"framing": {"payload": "integer", "payload_bits": 8, "colour": 1}}, "framing has an unknown field 'colour'"),
        ({"channels": [{"name": "a"}]}, "a channel of the scheme lacks axes, body, sigma, symbols"),
        (
            {"channels": [{"name": "a", "body": "a", "axes": "vx", "symbols": 1, "sigma": 0.1}]},
            "axes must be a list of names",
        ),
        (
            {"channels": [{"name": "a", "body": "a", "axes": ["vx"], "symbols": 1, "sigma": 0.1, "colour": 1}]},
            "a channel of the scheme has an unknown field 'colour'",
        ),
    ],
)
def test_a_table_that_is_no_scheme_is_refused(change, says):
    with pytest.raises(MtmError, match=says):
        scheme_from_table(table_of(FRAMED) | change)


def test_an_alphabet_has_2_to_65536_symbols():
    assert [one_channel(alphabet_size=size).alphabet_size for size in (2, 65_536)] == [2, 65_536]
    for size in (0, 1, 65_537):
        refused("choose 2 to 65536", alphabet_size=size)


def test_the_rate_is_a_million_hertz_at_most():
    assert one_channel(rate_hz=1e6, band_hz=(1e5, 4e5)).rate_hz == 1e6
    refused(r"rate_hz is 1e\+06; choose 1e\+06 at most", rate_hz=1.000_001e6, band_hz=(1e5, 4e5))


def test_a_message_has_4194304_ticks_at_most():
    assert one_channel(message_ticks=1 << 22, band_hz=(2.0, 2.1)).message_ticks == 1 << 22
    refused("message_ticks is 4194305; choose 4194304 at most", message_ticks=(1 << 22) + 1)


def test_the_band_lies_below_half_the_rate_lower_edge_first():
    assert one_channel(band_hz=(2.0, 24.999)).band_hz == (2.0, 24.999)
    refused("only what is below 25.0 Hz", band_hz=(2.0, 25.0))
    refused("put the lower edge first", band_hz=(20.0, 2.0))
    refused("put the lower edge first", band_hz=(2.0, 2.0))


def test_a_window_holds_two_tones_at_least():
    # Bins of a window of 20 ticks at 50 Hz lie 2.5 Hz apart.
    assert one_channel(message_ticks=20, band_hz=(2.5, 5.0)).message_ticks == 20
    refused("the shortest window that works is 20 ticks", message_ticks=18, band_hz=(2.5, 5.0))
    refused("fewer than two tones", message_ticks=20, band_hz=(2.5, 4.9))
    refused("widen the band", message_ticks=1000, band_hz=(2.0, 2.000_001))


@pytest.mark.parametrize(
    ("field", "value"),
    [("combine", "both"), ("pooling", "median"), ("power", "loud"), ("schedule", "daily"), ("combine", None)],
)
def test_a_choice_is_one_of_those_there_are(field, value):
    refused(f"^{field} is {value!r}; choose one of: ", **{field: value})


@pytest.mark.parametrize("value", [0.0, -1.0, float("nan"), float("inf"), "1", None, True])
def test_rates_bands_and_sigmas_are_numbers_above_zero(value):
    refused("rate_hz is .*above zero", rate_hz=value)
    refused("band_hz low is .*above zero", band_hz=(value, 20.0))
    refused("band_hz high is .*above zero", band_hz=(2.0, value))
    refused("sigma of channel 'a' is .*above zero", channel={"sigma": value})


def three_axes(sigma) -> Channel:
    return Channel("a", "a", ("vx", "vy", "wz"), 1, sigma)


def test_a_channel_may_have_a_sigma_for_each_axis():
    alike, own = three_axes(0.1), three_axes((0.1, 0.1, 0.2))
    assert (alike.sigmas, own.sigmas) == ((0.1, 0.1, 0.1), (0.1, 0.1, 0.2))
    assert (alike.sigma_text, own.sigma_text) == ("0.1", "0.1, 0.1, 0.2")
    scheme = small_scheme(channels=(own,))
    assert "sigma = [0.1, 0.1, 0.2]" in scheme_text(scheme)
    assert scheme_from_table(table_of(scheme)) == scheme
    assert len({scheme.fingerprint, small_scheme(channels=(alike,)).fingerprint}) == 2


def test_some_axes_of_a_channel_keep_their_own_sigmas():
    own = three_axes((0.1, 0.15, 0.2))
    assert (own.on(("vx", "vy")).sigmas, own.on(("wz",)).sigmas) == ((0.1, 0.15), (0.2,))
    assert three_axes(0.1).on(("wz",)) == Channel("a", "a", ("wz",), 1, 0.1)


@pytest.mark.parametrize("sigma", [(), (0.1,), (0.1, 0.2), (0.1, 0.2, 0.3, 0.4)])
def test_sigmas_are_one_for_all_axes_or_one_for_each(sigma):
    with pytest.raises(MtmError, match="has 3 axes and .* sigmas; give one sigma for all axes, or one for each"):
        small_scheme(channels=(three_axes(sigma),))


@pytest.mark.parametrize("value", [0.0, -1.0, float("nan"), "1", None, True])
def test_each_axis_s_sigma_is_a_number_above_zero(value):
    with pytest.raises(MtmError, match="sigma of axis 2 of channel 'a' is .*above zero"):
        small_scheme(channels=(three_axes((0.1, value, 0.2)),))


@pytest.mark.parametrize("value", [-1, 1.5, "1", None, True, 1 << 63])
def test_counts_are_whole_numbers_of_63_bits(value):
    refused("alphabet_size is .*whole number", alphabet_size=value)
    refused("message_ticks is .*whole number", message_ticks=value)
    refused("epoch is .*whole number", epoch=value)
    refused("symbols of channel 'a' is .*whole number", channel={"symbols": value})


def test_an_epoch_may_be_any_number_of_63_bits():
    assert [one_channel(epoch=epoch).epoch for epoch in (0, (1 << 63) - 1)] == [0, (1 << 63) - 1]


@pytest.mark.parametrize("text", ["", "a\n", 'a"', "a\\", None, 3])
def test_names_are_printable_text_without_quotes(text):
    refused("cannot be a name", name=text)
    refused("cannot be a name", channel={"name": text})
    refused("cannot be a name", channel={"body": text})
    refused("cannot be a name", channel={"axes": ("vx", text)})


def test_a_channel_has_axes_each_named_once_and_symbols():
    refused("one or more axes", channel={"axes": ()})
    refused("each named once", channel={"axes": ("vx", "vx")})
    refused("sends 0 symbols; give it at least 1", channel={"symbols": 0})
    assert one_channel(channel={"axes": ("vx", "vy")}).channels[0].axes == ("vx", "vy")


@pytest.mark.parametrize(("ticks", "symbols", "nearest"), [(121, 2, 120), (119, 3, 120), (0, 1, 1), (1, 3, 3)])
def test_windows_divide_the_message(ticks, symbols, nearest):
    refused(f"{ticks} message_ticks do not divide into {symbols} .*; {nearest} would",
            message_ticks=ticks, channel={"symbols": symbols})  # fmt: skip


@pytest.mark.parametrize("ticks", [1, 2])
def test_a_message_of_a_tick_is_one_window_that_is_too_short(ticks):
    refused("fewer than two tones .* shortest window that works is 5 ticks", message_ticks=ticks)


def test_channels_have_names_of_their_own_and_may_share_a_body():
    channels = (Channel("a", "x", ("vx",), 1, 0.1), Channel("b", "x", ("vy",), 1, 0.1))
    assert len(small_scheme(channels=channels).channels) == 2
    with pytest.raises(MtmError, match="two channels have the same name"):
        small_scheme(channels=(channels[0], replace(channels[1], name="a")))


def test_channels_that_say_the_same_have_as_many_symbols():
    channels = (Channel("a", "a", ("vx",), 2, 0.1), Channel("b", "b", ("vx",), 3, 0.1))
    with pytest.raises(MtmError, match="same number of symbols on every channel"):
        small_scheme(channels=channels, combine="same")
    assert small_scheme(channels=channels, combine="split").message_symbols == 5


def test_a_framing_that_does_not_fit_is_refused_with_the_scheme():
    with pytest.raises(MtmError, match="do not fit into the 4 symbols"):
        small_scheme(framing=Framing("integer", 16))


@pytest.mark.parametrize(
    ("rate_hz", "band_hz", "shortest"),
    [
        (50.0, (0.5, 5.0), 20),
        (50.0, (2.0, 20.0), 5),
        (10.0, (0.5, 2.0), 10),
        (50.0, (4.9, 5.0), 500),
        (50.0, (1.0, 1.001), 50_000),
        (5.0, (1.0, 2.4), 5),
        (10.0, (0.1, 4.9), 5),
        (50.0, (1.0, 1.000_03), None),
    ],
)
def test_the_shortest_windows_of_some_bands(rate_hz, band_hz, shortest):
    assert shortest_window(rate_hz, band_hz) == shortest


@given(rate_hz=st.floats(5, 100), low=st.floats(0.01, 0.3), width=st.floats(0.01, 0.15), below=st.integers(1, 400))
def test_no_window_is_sought_beyond_the_given_length(rate_hz, low, width, below):
    band_hz = (low * rate_hz, (low + width) * rate_hz)
    whole, bounded = shortest_window(rate_hz, band_hz), shortest_window(rate_hz, band_hz, below)
    assert bounded == (whole if whole is not None and whole < below else None)


@given(rate_hz=st.floats(5, 100), low=st.floats(0.01, 0.3), width=st.floats(0.01, 0.15))
def test_the_shortest_window_has_two_tones_and_no_shorter_one(rate_hz, low, width):
    band_hz = (low * rate_hz, (low + width) * rate_hz)
    shortest = shortest_window(rate_hz, band_hz)
    assert shortest is not None
    assert count_bins(shortest, rate_hz, band_hz) >= 2
    assert all(count_bins(ticks, rate_hz, band_hz) < 2 for ticks in range(1, shortest))


@given(ticks=st.integers(1, 500), rate_hz=st.floats(1, 200), low=st.floats(0.001, 0.4), width=st.floats(0.001, 0.4))
def test_bins_are_counted_as_the_definition_says(ticks, rate_hz, low, width):
    band_hz = (low * rate_hz, min(low + width, 0.499) * rate_hz)
    definition = [k for k in range(1, ticks) if k < ticks / 2 and band_hz[0] <= k * rate_hz / ticks <= band_hz[1]]
    assert count_bins(ticks, rate_hz, band_hz) == len(definition)


def test_one_channel_may_say_the_same_as_itself():
    assert one_channel(combine="same").message_symbols == 1


@pytest.mark.parametrize(("ticks", "count"), [(1, 0), (2, 0), (3, 1), (10, 4), (11, 5)])
def test_no_bin_at_half_the_rate_or_beyond_is_counted(ticks, count):
    assert count_bins(ticks, 50.0, (1.0, 1000.0)) == count


def test_edges_of_the_band_belong_to_it():
    assert count_bins(20, 50.0, (2.5, 5.0)) == 2
    assert count_bins(20, 50.0, (2.5, 24.0)) == 9


def test_no_parameter_is_left_out_of_the_table():
    whole = replace(FRAMED, spectrum=((2.0, 0.0), (20.0, -6.0)))
    assert set(table_of(whole)) == set(json.loads(json.dumps(asdict(whole))))
