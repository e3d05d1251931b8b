"""What a survey found, in words."""

from datetime import UTC, datetime

from mtm_audit.reporting.film_limits import CODEC_NAMES
from mtm_audit.survey.colours import ShownColour
from mtm_audit.survey.film import FilmSurvey
from mtm_audit.survey.log import Body, LogSurvey
from mtm_audit.survey.motion import Motion
from mtm_audit.survey.timeline import Timeline

_TIMES = {
    "stated": "stated by the file",
    "order": "by the order of the file, which states no times",
    "even": "assumed to be even",
}
_MARKER_M = 0.1
_LEAST_MARKER_PX = 20.0
_MOST_LISTED = 12
_NOTHING = (
    "nothing that a tracker finds by itself; put a marker or a colour on each robot, or name a region that shows one "
    "with --tracker flow:X0,Y0,X1,Y1"
)

# A line's head, empty where it goes on, and the line.
Line = tuple[str, str]


def film_lines(survey: FilmSurvey, frame_rate_hz: float | None = None) -> list[Line]:
    """What is in a film."""
    lines = [("film", _film(survey)), ("times", _times(survey, frame_rate_hz))]
    if survey.recorded_unix_s is not None:
        lines.append(("recorded", f"{_utc(survey.recorded_unix_s)}, by the file"))
    lines.append(("camera", survey.camera.sentence))
    lines += _headed("markers", _markers(survey) or ["none of any dictionary"])
    lines += _headed("colours", [_colour(colour) for colour in survey.colours] or ["none that stand out"])
    if survey.regions:
        lines += _headed("regions", [f"something moves in {','.join(map(str, region))}" for region in survey.regions])
    lines += _headed("motion", _motions(survey))
    lines += _headed("carries", _carries(survey))
    return lines


def log_lines(survey: LogSurvey) -> list[Line]:
    """What is in a log."""
    lines = [("log", f"{survey.path}: {survey.format or 'a table of numbers'}")]
    if survey.begun_unix_s is not None:
        first_s = min(body.timeline.begin_s for body in survey.bodies)
        lines.append(("recorded", f"from {_utc(survey.begun_unix_s + first_s)} on, by its clock"))
    lines += _headed("bodies", [_body(body) for body in survey.bodies])
    said = []
    for topic in survey.topics:
        found = "; ".join(_body(body) for body in topic.bodies) or topic.refusal or "not looked at"
        said.append(f"{topic.name}: {found}")
    return lines + _headed("topics", said)


def _utc(unix_s: float) -> str:
    return f"{datetime.fromtimestamp(unix_s, UTC):%Y-%m-%d %H:%M:%S} UTC"


def _headed(head: str, said: list[str]) -> list[Line]:
    return [(head if number == 0 else "", line) for number, line in enumerate(said)]


def _film(survey: FilmSurvey) -> str:
    name = str(survey.files[0]) + (f" and {len(survey.files) - 1} more" if len(survey.files) > 1 else "")
    width, height = survey.size
    if survey.structure is None:
        return f"{name}: single pictures of {width} x {height} pixels"
    made = survey.structure
    turned = "" if not made.turned_deg else f", turned by {made.turned_deg} degrees clockwise"
    odd = ", to be turned by an odd angle, which is not heeded" if made.turned_deg is None else ""
    mirrored = ", mirrored" if made.mirrored else ""
    codec = CODEC_NAMES.get(made.codec, made.codec)
    return f"{name}: {codec} in {made.container}, {width} x {height} pixels{turned}{odd}{mirrored}"


def _times(survey: FilmSurvey, frame_rate_hz: float | None) -> str:
    origin = "in the pictures' names or by --frame-rate" if survey.structure is None else _TIMES[survey.structure.times]
    if frame_rate_hz is not None:
        origin = f"by --frame-rate {frame_rate_hz:g}"
    hidden = 0 if survey.structure is None else survey.structure.hidden
    cut = f"; an edit list hides {hidden} more pictures" if hidden else ""
    return f"{_timeline(survey.timeline, 'pictures')}; {origin}{cut}"


def _timeline(timeline: Timeline, what: str) -> str:
    span = f"{timeline.count} {what}, {timeline.duration_s:.1f} s from {timeline.begin_s:.3f} s on"
    if timeline.rate_hz is None:
        return span
    kind = "constant" if timeline.is_constant else "variable"
    longest = f"{timeline.longest_s:.2f} s"
    many = f", a gap of {longest}" if timeline.gaps == 1 else f", {timeline.gaps} gaps of up to {longest}"
    return f"{span}, {timeline.rate_hz:.4g} a second, {kind}{many if timeline.gaps else ''}"


def _markers(survey: FilmSurvey) -> list[str]:
    said = []
    for dictionary in survey.markers.dictionaries:
        own = [marker for marker in survey.markers.markers if marker.dictionary == dictionary]
        sides = [marker.side_px for marker in own]
        numbers = _listed([str(marker.number) for marker in sorted(own, key=lambda marker: marker.number)])
        wide = f"{min(sides):.0f}" if max(sides) - min(sides) < 1.0 else f"{min(sides):.0f} to {max(sides):.0f}"
        mirror = ", in the mirrored picture" if survey.markers.mirrored else ""
        said.append(f"{dictionary}: {numbers}, {wide} px wide{mirror}")
    if survey.markers.markers and min(marker.side_px for marker in survey.markers.markers) < _LEAST_MARKER_PX:
        said.append(f"below {_LEAST_MARKER_PX:.0f} px they are read now and then only: come closer")
    return said


def _colour(colour: ShownColour) -> str:
    if colour.is_background:
        return f"{colour.name}, hue {colour.hue_deg:.0f} degrees: {100.0 * colour.share:.0f} % of the picture"
    box = colour.boxes[min(colour.boxes)]
    many = "one patch" if colour.patches == 1 else f"{colour.patches} patches"
    moves = "moves" if colour.moves else "stands still"
    size = f"{box[2] - box[0]} x {box[3] - box[1]} px at {','.join(map(str, box))}"
    return f"{colour.name}, hue {colour.hue_deg:.0f} degrees: {many}, the largest {size}, {moves}"


def _motions(survey: FilmSurvey) -> list[str]:
    if not survey.motions:
        return [] if survey.regions else [_NOTHING]
    still = [motion for motion in survey.motions if motion.is_still]
    said = [_motion(motion) for motion in survey.motions if not motion.is_still][:_MOST_LISTED]
    return said + ([f"{_listed([motion.name for motion in still])}: at rest"] if still else [])


def _motion(motion: Motion) -> str:
    return (
        f"{motion.name}: seen in {100.0 * motion.seen:.0f} % of the pictures, goes {motion.travel_px:.0f} px, "
        f"{motion.fast_px:.2g} px rms about its means over 2 s"
    )


def _carries(survey: FilmSurvey) -> list[str]:
    said = []
    if survey.compression is not None:
        low_px, high_px = survey.compression.smallest_motion_px
        coded = survey.compression
        quantiser = "" if coded.quantiser is None else f", quantiser {coded.quantiser:.0f}"
        line = (
            f"motion of a sharp marker down to {_range(low_px, high_px, '.2f')} px, and several times as much of small "
            f"or soft things ({coded.bits_per_pixel:.2g} bits a pixel{quantiser})"
        )
        if survey.markers.markers:
            side_px = float(min(marker.side_px for marker in survey.markers.markers))
            per_m = side_px / _MARKER_M
            line += (
                f"; if markers are 10 cm wide, the smallest has {per_m:.0f} px a metre, so that is "
                f"{_range(1000.0 * low_px / per_m, 1000.0 * high_px / per_m, '.2g')} mm"
            )
        said.append(line)
    if survey.highest_hz is not None:
        said.append(f"motion up to {survey.highest_hz:.3g} Hz, half of the pictures a second")
    return said


def _range(low: float, high: float, form: str) -> str:
    texts = f"{low:{form}}", f"{high:{form}}"
    return texts[0] if texts[0] == texts[1] else " to ".join(texts)


def _body(body: Body) -> str:
    ahead = "" if body.heading_axis is None else f" of its {body.heading_axis} axis"
    turns = f"headings{ahead} in {100.0 * body.headings:.0f} %" if body.headings else "no headings"
    seen = "" if body.seen == 1.0 else f", seen in {100.0 * body.seen:.0f} %"
    return (
        f"{body.name}: {_timeline(body.timeline, 'samples')}{seen}, {','.join(body.axes)} in {body.unit}, goes "
        f"{body.travel:.3g} {body.unit}, {turns}"
    )


def _listed(names: list[str]) -> str:
    more = f" and {len(names) - _MOST_LISTED} more" if len(names) > _MOST_LISTED else ""
    return ", ".join(names[:_MOST_LISTED]) + more
