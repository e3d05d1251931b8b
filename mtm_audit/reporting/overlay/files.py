"""The film anew, with what was seen in it drawn over it."""

from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

import cv2
import numpy as np

from mtm_audit.decoding.decoding import Decoding
from mtm_audit.drawing.film import film_writer, write_picture
from mtm_audit.drawing.mark import Mark
from mtm_audit.drawing.output import check_output_path
from mtm_audit.drawing.overlay import draw
from mtm_audit.drawing.sheet import contact_sheet
from mtm_audit.ingest.films import film_frames
from mtm_audit.ingest.source import Source
from mtm_audit.model.picture import Frame, Image
from mtm_audit.model.pictured import Pictured
from mtm_audit.model.recording import Recording
from mtm_audit.model.spread import spread_evenly
from mtm_audit.reporting.overlay.marks import Marker
from mtm_audit.reporting.overlay.passing import Windows, tracks_by_body, windows_of
from mtm_audit.reporting.text import verdict_sentence
from mtm_audit.tracking.registry import tracker
from mtm_onboard.protocol.errors import MtmError

COMMAND = "mtm-audit decode"
FILM_SUFFIXES, STILL_SUFFIXES = (".mp4",), (".png",)
_SHEET_PICTURES = 12
_THUMB_PX = 640  # the larger side of a picture on a sheet


@dataclass(frozen=True)
class OverlayFiles:
    """What to draw: a `film` with everything drawn over it, one `still` of it, a contact `sheet`; None for neither."""

    film: Path | None = None
    still: Path | None = None
    sheet: Path | None = None

    @property
    def paths(self) -> tuple[Path | None, ...]:
        """Where they are written."""
        return self.film, self.still, self.sheet

    @property
    def options(self) -> tuple[str, ...]:
        """The options that ask for them."""
        overlay = ("--overlay",) if self.film or self.still else ()
        return overlay + (("--sheet",) if self.sheet else ())


def overlay_files(overlay: Path | None, sheet: Path | None) -> OverlayFiles:
    """What `--overlay` and `--sheet` ask for; raises MtmError when one of them cannot be written."""
    if overlay is not None:
        check_output_path(overlay, (*FILM_SUFFIXES, *STILL_SUFFIXES), "film or picture")
    if sheet is not None:
        check_output_path(sheet, STILL_SUFFIXES)
    is_film = overlay is not None and overlay.suffix.lower() in FILM_SUFFIXES
    return OverlayFiles(overlay if is_film else None, None if is_film else overlay, sheet)


def check_pictures(files: OverlayFiles, sources: Sequence[Source]) -> None:
    """Raise MtmError when something is to be drawn on several recordings, one without pictures, or over itself."""
    if not files.options:
        return
    source = sources[0]
    if len(sources) > 1:
        raise MtmError(f"{files.options[0]} draws one recording, and {len(sources)} are named; name one")
    if source.kind != "video":
        raise MtmError(f"{source.name} has no pictures to draw on; leave {' and '.join(files.options)} out")
    for path in files.paths:
        if path is not None and any(path.exists() and path.samefile(own) for own in source.files):
            raise MtmError(f"{path} is the recording itself; name another file to draw into")


def draw_overlay(
    recording: Recording,
    decoding: Decoding,
    files: OverlayFiles,
    tracker_name: str,
    frame_rate_hz: float | None = None,
    progress: Callable[[int], None] | None = None,
    *,
    force: bool = False,
) -> None:
    """Read the film once more and draw the files, whole or not at all; pictures are held one at a time.

    `tracker_name` and `frame_rate_hz` are those with which the recording was read. `progress` receives the number of
    pictures read so far; with `force` what the command did not make is replaced as well. Raises MtmError as reading and
    writing do.
    """
    if recording.pictured is None:
        raise MtmError("the recording has no pictures to draw on; leave --overlay and --sheet out")
    begin_s = min(float(track.times_s[0]) for track in recording.pictured.tracks)
    windows = windows_of(decoding, begin_s, recording.speed)
    dictionary = getattr(tracker(tracker_name), "dictionary", None)
    marker = Marker(recording.pictured, windows, tracks_by_body(decoding), dictionary)
    caption = _caption(recording, decoding)
    still_row = None if files.still is None else _still_row(recording.pictured, windows)
    sheet_rows = spread_evenly(recording.frames, _SHEET_PICTURES)
    thumbs: list[Image] = []
    with nullcontext() if files.film is None else film_writer(files.film, COMMAND, force=force) as write:
        frames = film_frames(recording.paths, "bgr", lambda sentence: None, frame_rate_hz)
        for row, frame in enumerate(frames):
            is_still, is_thumb = row == still_row, files.sheet is not None and row in sheet_rows
            if write is not None or is_still or is_thumb:
                gray = np.asarray(cv2.cvtColor(frame.image, cv2.COLOR_BGR2GRAY), dtype=np.uint8)
                marks = marker.marks(gray, frame.time_s)
                lines = (f"{frame.time_s:.2f} s", *caption)
                if write is not None:
                    write(Frame(frame.time_s, draw(frame.image, marks, lines)))
                if is_still and files.still is not None:
                    write_picture(draw(frame.image, marks, lines), files.still, COMMAND, force=force)
                if is_thumb:
                    thumbs.append(_thumb(frame.image, marks, lines[0]))
            if progress is not None:
                progress(row + 1)
    if files.sheet is not None:
        sheet = contact_sheet(thumbs, [*caption, f"drawn {datetime.now(UTC):%Y-%m-%d}"])
        write_picture(sheet, files.sheet, COMMAND, force=force)


def _caption(recording: Recording, decoding: Decoding) -> tuple[str, str]:
    names = recording.paths[0].name + (f" and {len(recording.paths) - 1} more" if len(recording.paths) > 1 else "")
    return f"{names} · key {decoding.key_id}", verdict_sentence(decoding)


def _still_row(pictured: Pictured, windows: Sequence[Windows]) -> int:
    """The picture that shows most: most tracks and passing symbols, and of those the one nearest to the middle."""
    times_s = pictured.tracks[0].times_s
    shown = np.sum([track.valid for track in pictured.tracks], axis=0)
    for each in windows:
        inside = (times_s[:, None] >= each.starts_s) & (times_s[:, None] < each.starts_s + each.length_s)
        shown = shown + inside.any(axis=1)
    best = np.flatnonzero(shown == shown.max())
    return int(best[np.argmin(np.abs(best - len(times_s) / 2))])


def _thumb(image: Image, marks: Sequence[Mark], caption: str) -> Image:
    """The picture made as small as a sheet has it and then drawn on, so that lines and letters keep their size."""
    scale = min(_THUMB_PX / max(image.shape[:2]), 1.0)
    size = max(round(scale * image.shape[1]), 1), max(round(scale * image.shape[0]), 1)
    small = np.asarray(cv2.resize(image, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)
    return draw(small, [mark.scaled(scale) for mark in marks], [caption])
