"""Looking through a film without a key."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from mtm_audit.ingest.films import film_compression, film_frames, is_picture
from mtm_audit.ingest.source import Source
from mtm_audit.model.compression import Compression
from mtm_audit.model.picture import Frame
from mtm_audit.readers.video import inspect_video
from mtm_audit.readers.video.structure import FilmStructure, read_structure
from mtm_audit.survey.colours import ShownColour, find_colours
from mtm_audit.survey.kept import kept_frames
from mtm_audit.survey.markers import ShownMarkers, find_markers
from mtm_audit.survey.motion import CameraMotion, Motion, camera_motion, moving, tracked_motion
from mtm_audit.survey.regions import moving_regions
from mtm_audit.survey.timeline import Timeline, timeline_of
from mtm_audit.tracking.region import Region
from mtm_audit.tracking.registry import tracker
from mtm_onboard.protocol.errors import MtmError

# What is done, and the number of pictures of it so far.
Progress = Callable[[str, int], None]


@dataclass(frozen=True, kw_only=True, eq=False)
class FilmSurvey:
    """What is in a film. `structure` and `compression` are of its first file, None for single pictures.

    `size` is width and height as players show it, `recorded_unix_s` when the file says that it was made. `kept` are
    some of the pictures, in whose numbers markers and colours are told. `trackers` are those that suit, the best first;
    `motions` what the first of them follows. `regions` hold what moves in the first picture, where there is nothing
    else to go by. `reference` are things that stand still while the camera moves.
    """

    files: tuple[Path, ...]
    structure: FilmStructure | None
    compression: Compression | None
    size: tuple[int, int]
    timeline: Timeline
    recorded_unix_s: float | None
    camera: CameraMotion
    markers: ShownMarkers
    colours: tuple[ShownColour, ...]
    regions: tuple[Region, ...]
    motions: tuple[Motion, ...]
    trackers: tuple[str, ...]
    reference: tuple[str, ...]
    kept: tuple[Frame, ...]
    warnings: tuple[str, ...]

    @property
    def highest_hz(self) -> float | None:
        """Half the rate: faster motion is not in the film."""
        return None if self.timeline.rate_hz is None else 0.5 * self.timeline.rate_hz


def survey_film(source: Source, frame_rate_hz: float | None = None, progress: Progress | None = None) -> FilmSurvey:
    """Read a film twice: once for its times and some pictures, once to follow what these show.

    `frame_rate_hz` replaces its times by even ones. Raises MtmError as reading does, and when the size of the picture
    changes.
    """
    told = progress or (lambda what, count: None)
    warnings: list[str] = list(source.warnings)
    frames = film_frames(source.files, "bgr", warnings.append, frame_rate_hz)
    times_s, kept = kept_frames(frames, lambda count: told("looking", count))
    markers, colours = find_markers(kept), find_colours(kept)
    trackers = _trackers(markers, colours)
    motions, camera, trackers = _followed(source.files, trackers, frame_rate_hz, warnings, told)
    regions: tuple[Region, ...] = ()
    if not trackers and not camera.moves:
        regions = moving_regions(kept)
        trackers = tuple(f"flow:{','.join(map(str, region))}" for region in regions)
    single = _is_single_pictures(source.files)
    still = [motion.name for motion in motions if motion.is_still]
    return FilmSurvey(
        files=source.files,
        structure=None if single else read_structure(source.files[0], frame_rate_hz),
        compression=film_compression(source.files),
        size=kept[0].size,
        timeline=timeline_of(times_s),
        recorded_unix_s=None if single else inspect_video(source.files[0]).created_unix_s,
        camera=camera,
        markers=markers,
        colours=colours,
        regions=regions,
        motions=motions,
        trackers=trackers,
        reference=tuple(still) if camera.moves and moving(motions) else (),
        kept=kept,
        warnings=tuple(warnings),
    )


def _trackers(markers: ShownMarkers, colours: Sequence[ShownColour]) -> tuple[str, ...]:
    """Those for each dictionary, and one for the colours that move."""
    mirrored = ",mirrored" if markers.mirrored else ""
    names = [f"aruco:{dictionary}{mirrored}" for dictionary in markers.dictionaries]
    patches = [colour.name for colour in colours if colour.moves and not colour.is_background]
    return (*names, *([f"colour:{','.join(patches)}"] if patches else []))


def _followed(
    files: Sequence[Path],
    trackers: tuple[str, ...],
    frame_rate_hz: float | None,
    warnings: list[str],
    told: Progress,
) -> tuple[tuple[Motion, ...], CameraMotion, tuple[str, ...]]:
    """What the first tracker follows, the camera's motion, and the trackers without those that follow nothing."""
    for number, name in enumerate(trackers):
        pixels = tracker(name).pixels
        frames = film_frames(files, pixels, lambda sentence: None, frame_rate_hz)
        try:
            motions, camera = tracked_motion(frames, name, warnings.append, lambda count: told("following", count))
        except MtmError:
            continue
        return motions, camera, trackers[number:]
    frames = film_frames(files, "gray", lambda sentence: None, frame_rate_hz)
    return (), camera_motion(frames, lambda count: told("following", count)), ()


def _is_single_pictures(files: Sequence[Path]) -> bool:
    return files[0].is_dir() or all(map(is_picture, files))
