"""What panels show, and what they must not: a winner where there is none, or a robot as read that was not."""

from dataclasses import replace

import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.patches import Rectangle

from mtm_audit.model.track import Track
from mtm_audit.reporting.panels.evidence import draw_evidence
from mtm_audit.reporting.panels.growth import draw_growth, grown_bits, has_growth
from mtm_audit.reporting.panels.rows import channel_note, evidence_rows, score_rows
from mtm_audit.reporting.panels.scores import draw_margins, draw_scores
from mtm_audit.reporting.panels.timing import draw_timing
from mtm_audit.reporting.panels.tracks import draw_tracks, draw_tracks_over
from tests.audit.reporting.pictured import (
    both_sent,
    decoding_of,
    exchanged,
    one_silent,
    one_unseen,
    track,
    under_another_key,
)


@pytest.fixture
def axes():
    figure = Figure()
    FigureCanvasAgg(figure)
    return figure.subplots()


def texts(axes):
    """Everything that is written into the axes and at its rows."""
    axes.figure.canvas.draw()
    return " | ".join(text.get_text() for text in [*axes.texts, *axes.get_yticklabels()] if text.get_text())


def bar_lengths(axes):
    return [patch.get_width() for patch in axes.patches if isinstance(patch, Rectangle)]


def test_an_absent_message_has_one_bar_and_no_robot_s(axes):
    _, decoding = under_another_key()
    draw_evidence(axes, decoding)
    assert decoding.verdict == "absent"
    assert bar_lengths(axes) == pytest.approx([decoding.evidence.bits])
    assert "robot" not in texts(axes)


def test_what_chance_says_of_a_channel_is_no_note():
    _, decoding = under_another_key()
    assert {channel_note(item, decoding) for item in decoding.channels} == {""}
    assert any(item.state == "silent" for item in decoding.channels)


def test_windows_of_an_absent_message_are_not_drawn(axes):
    draw_timing(axes, under_another_key()[1])
    assert not axes.texts
    assert len(axes.collections) == 2  # what was seen of each robot
    assert not has_growth(under_another_key()[1])


def test_the_evidence_of_each_symbol_is_written_beside_its_bar(axes):
    _, decoding = both_sent()
    draw_evidence(axes, decoding)
    expected = [nats / np.log(2.0) for nats in decoding.symbol_nats]
    assert bar_lengths(axes) == pytest.approx(expected)
    assert all(f"{bits:.1f}" in texts(axes) for bits in expected)


@pytest.mark.parametrize(("made", "note"), [(one_unseen, "unseen"), (one_silent, "silent")])
@pytest.mark.parametrize("draw", [draw_evidence, draw_scores, draw_timing])
def test_a_robot_that_shows_nothing_is_named_with_why(axes, made, note, draw):
    _, decoding = made()
    assert decoding.verdict == "inconclusive"
    draw(axes, decoding)
    assert "robot1" in texts(axes)
    assert note in texts(axes)


def test_an_exchanged_robot_s_bar_says_where_it_is(axes):
    _, decoding = exchanged()
    assert decoding.verdict == "decoded"
    draw_evidence(axes, decoding)
    assert "exchanged: is track robot1" in texts(axes)


@pytest.mark.parametrize(("made", "certain"), [(both_sent, [(3, 0), (1, 1)]), (one_silent, [(3, 0)])])
def test_only_certain_symbols_are_framed(axes, made, certain):
    draw_scores(axes, made()[1])
    assert [tuple(np.round(frame.get_center())) for frame in axes.patches] == certain


def test_what_is_not_certain_has_no_lead(axes):
    draw_margins(axes, one_silent()[1])
    assert sum("+" in text.get_text() for text in axes.texts) == 1
    assert "not certain" in texts(axes)


def test_of_many_places_the_unseen_are_named_below():
    _, decoding = one_unseen()
    unseen = decoding.channels[1]
    many = replace(decoding, channels=(*decoding.channels[:1], *[unseen] * 40))
    figure = Figure()
    FigureCanvasAgg(figure)
    axes = figure.subplots()
    draw_scores(axes, many)
    assert "robot1 unseen" in axes.get_xlabel()


def test_channels_that_say_the_same_keep_their_notes():
    _, decoding = one_unseen()
    same = replace(decoding, scheme=replace(decoding.scheme, combine="same"))
    names, notes, bits = evidence_rows(same)
    assert names == ["symbol 0", "symbol 1", "robot1"]
    assert notes[-1] == "unseen"
    assert np.isnan(bits[-1])


def test_rows_of_an_unseen_robot_have_no_scores():
    seen, unseen = score_rows(one_unseen()[1])
    assert np.isfinite(seen.scores).all()
    assert (np.isnan(unseen.scores).all(), unseen.symbol, unseen.note) == (True, None, "unseen")


def test_evidence_grows_by_window_when_it_ends(axes):
    _, decoding = both_sent()
    item = decoding.channels[0]
    ends_s, bits = grown_bits(item, decoding)
    scores = item.reading.window_scores
    means = np.log2(np.mean(np.exp2(scores / np.log(2.0)), axis=1))
    assert bits == pytest.approx(np.cumsum(means))
    assert ends_s == pytest.approx(item.reading.window_starts_s + 400 / item.reading.timing.rate_hz)
    draw_growth(axes, decoding)
    assert [len(line.get_xdata()) for line in axes.lines] == [1 + len(ends_s)] * 2


def test_windows_are_drawn_where_they_were_read(axes):
    _, decoding = both_sent()
    draw_timing(axes, decoding)
    windows = sum(len(item.reading.window_starts_s) for item in decoding.channels)
    assert [text.get_text() for text in axes.texts] == ["0"] * windows
    assert windows >= 4


def test_decoys_are_drawn_where_there_is_no_exact_evidence(axes):
    _, decoding = decoding_of(track(0), track(1), detector="coherency", decoys=20)
    draw_evidence(axes, decoding)
    assert axes.get_title() == "This key against keys that nobody holds"
    assert not has_growth(decoding)


def pixels(name="marker0"):
    """From the lower left corner of a picture of 100 x 50 to its upper right one."""
    positions = np.array([[0.0, 0.0], [50.0, 20.0], [99.0, 49.0]])
    return Track(name, np.arange(3.0), positions, np.ones(3, dtype=bool), unit="px")


def test_tracks_in_pixels_point_down_as_in_the_picture(axes):
    draw_tracks(axes, (pixels(),), height_px=50)
    rows = axes.lines[0].get_ydata()
    assert list(rows) == [49.0, 29.0, 0.0]
    assert axes.yaxis_inverted()


def test_tracks_over_a_picture_fill_exactly_it(axes):
    draw_tracks_over(axes, (pixels(),), (100, 50))
    assert (axes.get_xlim(), axes.get_ylim()) == ((-0.5, 99.5), (49.5, -0.5))
    assert [text.get_text() for text in axes.texts] == ["marker0"]


def test_pixels_of_a_picture_of_unknown_height_say_so(axes):
    draw_tracks(axes, (pixels(),))
    assert axes.get_ylabel() == "y [px, upwards from the lowest row]"


def test_tracks_in_metres_point_up(axes):
    draw_tracks(axes, both_sent()[0].tracks)
    assert not axes.yaxis_inverted()


@pytest.mark.parametrize("name", ["_hidden", "a$b$c", "x$\\frac", "body[left]", "<b>", "line\nbreak", "机器人"])
@pytest.mark.filterwarnings("ignore:Glyph")
def test_any_name_of_a_track_is_drawn_as_it_is(axes, name):
    draw_tracks(axes, (pixels(name),), height_px=50)
    axes.figure.canvas.draw()
    (entry,) = axes.get_legend().get_texts()
    assert entry.get_text().strip().replace("\\$", "$") == name.replace("\n", "\ufffd")


def test_a_track_that_was_never_seen_is_no_error(axes):
    unseen = Track("marker0", np.arange(3.0), np.full((3, 2), np.nan), np.zeros(3, dtype=bool), unit="px")
    draw_tracks_over(axes, (unseen,), (100, 50))
    assert not axes.texts
