from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from mtm_audit.model.compression import Compression
from mtm_audit.model.picture import Frame
from mtm_audit.readers.video.structure import FilmStructure
from mtm_audit.reporting.look.commands import film_commands, log_commands
from mtm_audit.reporting.look.sentences import film_lines, log_lines
from mtm_audit.survey.colours import ShownColour
from mtm_audit.survey.film import FilmSurvey
from mtm_audit.survey.log import Body, LogSurvey, Topic
from mtm_audit.survey.markers import ShownMarker, ShownMarkers
from mtm_audit.survey.motion import CameraMotion, Motion
from mtm_audit.survey.timeline import timeline_of

STRUCTURE = FilmStructure(
    container="mp4", codec="hevc", width_px=320, height_px=240, turned_deg=0, mirrored=False, times="stated", hidden=0
)
EMPTY = FilmSurvey(
    files=(Path("film.mp4"),),
    structure=STRUCTURE,
    compression=None,
    size=(320, 240),
    timeline=timeline_of(np.arange(61) / 30.0),
    recorded_unix_s=None,
    camera=CameraMotion(None, "nothing tells"),
    markers=ShownMarkers(),
    colours=(),
    regions=(),
    motions=(),
    trackers=(),
    reference=(),
    kept=(Frame(0.0, np.zeros((240, 320), np.uint8)),),
    warnings=(),
)
TENTHS = timeline_of(np.arange(11) / 10.0)
BODY = Body(
    name="left", timeline=TENTHS, unit="m", axes=("x", "y"), seen=0.9, headings=0.5, heading_axis=None, travel=2.0
)
LOG = LogSurvey(path=Path("a.bag"), format="ROS 1 bag", bodies=(BODY,), topics=(), begun_unix_s=None, warnings=())


def said(survey, head, *arguments):
    """The lines under a head, joined."""
    lines = film_lines(survey, *arguments) if isinstance(survey, FilmSurvey) else log_lines(survey)
    heads = [one for one, _ in lines]
    first = heads.index(head)
    last = next((row for row in range(first + 1, len(heads)) if heads[row]), len(heads))
    return "; ".join(line for _, line in lines[first:last])


def structured(**changes):
    return replace(EMPTY, structure=replace(STRUCTURE, **changes))


def square(left, upper, side):
    return np.array([[left, upper], [left + side, upper], [left + side, upper + side], [left, upper + side]], float)


def shown(dictionary, number, side_px):
    return ShownMarker(dictionary=dictionary, number=number, corners={0: square(10, 10, side_px)}, side_px=side_px)


def test_a_turned_film_is_told_as_players_show_it():
    assert said(EMPTY, "film") == "film.mp4: HEVC in mp4, 320 x 240 pixels"
    assert said(structured(turned_deg=90, mirrored=True), "film").endswith("turned by 90 degrees clockwise, mirrored")
    assert "an odd angle, which is not heeded" in said(structured(turned_deg=None), "film")
    assert said(replace(EMPTY, structure=None), "film") == "film.mp4: single pictures of 320 x 240 pixels"


def test_it_is_said_where_times_come_from():
    assert said(EMPTY, "times") == "61 pictures, 2.0 s from 0.000 s on, 30 a second, constant; stated by the file"
    assert "assumed to be even" in said(structured(times="even"), "times")
    assert "by the order of the file" in said(structured(times="order"), "times")
    assert said(EMPTY, "times", 120.0).endswith("; by --frame-rate 120")
    assert said(structured(hidden=15), "times").endswith("; an edit list hides 15 more pictures")


def test_gaps_and_uneven_times_are_told():
    gapped = replace(EMPTY, timeline=timeline_of(np.delete(np.arange(60) / 30.0, [10, 20])))
    assert "constant, 2 gaps of up to 0.07 s" in said(gapped, "times")
    one = replace(EMPTY, timeline=timeline_of(np.delete(np.arange(60) / 30.0, [10])))
    assert "constant, a gap of 0.07 s" in said(one, "times")
    uneven = replace(EMPTY, timeline=timeline_of(np.cumsum(np.tile([1 / 30, 1 / 24], 30))))
    assert "variable" in said(uneven, "times")


def test_a_film_of_nothing_says_what_to_do():
    assert "put a marker or a colour on each robot" in said(EMPTY, "motion")
    assert film_commands(EMPTY, [Path("film.mp4")], None) == ()


def test_markers_are_told_by_dictionary():
    markers = ShownMarkers((shown("6x6_250", 7, 40.0), shown("6x6_250", 3, 30.0), shown("4x4_50", 1, 15.0)), True)
    text = said(replace(EMPTY, markers=markers), "markers")
    assert "6x6_250: 3, 7, 30 to 40 px wide, in the mirrored picture" in text
    assert "4x4_50: 1, 15 px wide" in text
    assert "come closer" in text


def test_the_limit_of_the_codec_is_told_in_px_and_mm():
    coded = replace(
        EMPTY, compression=Compression("h264", 0.02, 23.0), markers=ShownMarkers((shown("4x4_50", 1, 30.0),))
    )
    text = said(coded, "carries")
    assert "down to 0.06 to 0.09 px" in text
    assert "300 px a metre, so that is 0.2 to 0.3 mm" in text
    assert "motion up to 15 Hz" in text
    assert "down to 0.02 px," in said(replace(EMPTY, compression=Compression("h264", 4.0, 0.0)), "carries")


def test_colours_and_motions_are_told():
    red = ShownColour(name="#dc2828", hue_deg=0.0, boxes={0: (10, 20, 40, 50)}, patches=2, share=0.01, moves=True)
    floor = replace(red, name="#28a028", hue_deg=120.0, share=0.6)
    text = said(replace(EMPTY, colours=(red, floor)), "colours")
    assert "#dc2828, hue 0 degrees: 2 patches, the largest 30 x 30 px at 10,20,40,50, moves" in text
    assert "#28a028, hue 120 degrees: 60 % of the picture" in text
    moving = Motion(name="red", seen=0.5, travel_px=100.0, fast_px=1.25, has_heading=False)
    still = replace(moving, name="marker40", travel_px=0.1, fast_px=0.05)
    text = said(replace(EMPTY, motions=(moving, still)), "motion")
    assert "red: seen in 50 % of the pictures, goes 100 px, 1.2 px rms about its means over 2 s" in text
    assert "marker40: at rest" in text


def test_commands_name_what_is_not_usual():
    suited = replace(EMPTY, trackers=("aruco:4x4_50", "colour:#dc2828"), reference=("marker40",))
    first, second = film_commands(suited, [Path("my film.mp4")], 30.0)
    assert first == (
        "mtm-audit decode 'my film.mp4' --key robot.key --reference marker40 --frame-rate 30"
    )  # fmt: skip
    assert second == "mtm-audit decode 'my film.mp4' --key robot.key --tracker 'colour:#dc2828' --frame-rate 30"


def test_a_log_is_told_with_its_gaps_and_headings():
    assert said(LOG, "log") == "a.bag: ROS 1 bag"
    assert said(LOG, "bodies") == (
        "left: 11 samples, 1.0 s from 0.000 s on, 10 a second, constant, seen in 90 %, x,y in m, goes 2 m, "
        "headings in 50 %"
    )
    ahead = replace(BODY, heading_axis="-y")
    assert "headings of its -y axis in 50 %" in said(replace(LOG, bodies=(ahead,)), "bodies")
    assert said(replace(LOG, begun_unix_s=1.7e9), "recorded") == "from 2023-11-14 22:13:20 UTC on, by its clock"
    later = replace(BODY, timeline=timeline_of(1.7e9 + np.arange(11) / 10.0))
    since_1970 = replace(LOG, begun_unix_s=0.0, bodies=(later,))
    assert said(since_1970, "recorded") == "from 2023-11-14 22:13:20 UTC on, by its clock"
    assert log_commands([LOG], [Path("a.bag")]) == ("mtm-audit decode a.bag --key robot.key",)


def test_a_topic_is_named_where_there_is_a_choice():
    topics = (Topic(name="/odom", bodies=(BODY,)), Topic(name="/scan", refusal="no poses"), Topic(name="/late"))
    chosen = replace(LOG, bodies=(), topics=topics)
    text = said(chosen, "topics")
    assert text.startswith("/odom: left: 11 samples")
    assert "/scan: no poses" in text
    assert "/late: not looked at" in text
    assert log_commands([chosen], [Path("a.bag")]) == ("mtm-audit decode a.bag --key robot.key --topic /odom",)


def test_topics_that_move_and_are_frequent_come_first():
    still, slow = replace(BODY, travel=0.0), replace(BODY, timeline=timeline_of(np.arange(11.0)))
    topics = tuple(
        Topic(name=name, bodies=(body,)) for name, body in (("/wheel", still), ("/amcl", slow), ("/odom", BODY))
    )
    commands = log_commands([replace(LOG, bodies=(), topics=topics)], [Path("a.bag")])
    assert [command.rpartition(" ")[2] for command in commands] == ["/odom", "/amcl", "/wheel"]


@pytest.mark.parametrize("unix_s", [0.0, 1.7e9])
def test_when_it_was_recorded_is_told(unix_s):
    assert said(replace(EMPTY, recorded_unix_s=unix_s), "recorded").endswith("UTC, by the file")
