"""Real films that hold no message: none may be decoded, none may fail otherwise than by a sentence.

    python -m tests.audit.real_videos FOLDER --out real_videos.csv

FOLDER holds the films as OWNER+NAME/PATH, of the public repository github.com/OWNER/NAME; they are their authors' and
not here. Each is tracked in several ways and decoded with keys that nobody has used, so that chance alone says
"decoded", once in 10,000. The table has what came out, and the sentence of every refusal.
"""

import argparse
import hashlib
import sys
import time
import traceback
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from hil.experiments.runs.result_file import write_result_csv
from mtm_audit.decoding.decode import decode_tracks
from mtm_audit.decoding.settings import DecodeSettings
from mtm_audit.ingest.recording import read_recording, recording_files
from mtm_audit.readers.video import inspect_video
from mtm_onboard.protocol import Channel, Key, MtmError, Scheme

KEYS = 5
# A message of one symbol, 2 s long and repeated: as little as a film could hold.
SCHEME = Scheme(
    name="real videos", rate_hz=50.0, band_hz=(0.5, 5.0), alphabet_size=4, message_ticks=100,
    channels=(Channel("robot", "robot", ("vx", "vy"), 1, 0.1),),
)  # fmt: skip
COLUMNS = ("repository", "path", "sha256", "tracker", "tracks", "frames", "verdicts", "sentence", "seconds")


def trackers(path: Path) -> Iterator[str]:
    """The ways in which a film is tracked: markers, colours, and the middle of the picture by its texture."""
    yield from ("aruco", "aruco:apriltag_36h11", "colour:red", "centroid:red")
    try:
        film = inspect_video(path)
    except MtmError:
        return
    width, height = film.width_px, film.height_px
    yield f"flow:{width // 4},{height // 4},{width * 3 // 4},{height * 3 // 4}"


def looked_at(path: Path, tracker: str) -> tuple[int, int, str, str]:
    """Tracks, frames, verdicts by number, and the first refusal or what failed."""
    verdicts: Counter[str] = Counter()
    sentence = ""
    tracks = frames = 0
    try:
        recording = read_recording(*recording_files([path]), tracker)
        tracks, frames = len(recording.tracks), len(recording.tracks[0].times_s)
    except MtmError as error:
        return 0, 0, "refused", str(error)
    for number in range(KEYS):
        key = Key("nobody", hashlib.sha256(f"fake key {number}".encode()).digest(), SCHEME)
        try:
            verdicts[decode_tracks(recording.tracks, key, DecodeSettings()).verdict] += 1
        except MtmError as error:
            verdicts["refused"] += 1
            sentence = sentence or str(error)
    return tracks, frames, " ".join(f"{name} {count}" for name, count in sorted(verdicts.items())), sentence


def rows_of(folder: Path, path: Path) -> Iterator[tuple[object, ...]]:
    """One row for each tracker."""
    place = path.relative_to(folder)
    repository = place.parts[0].replace("+", "/", 1)
    digest = hashlib.sha256(path.read_bytes()).hexdigest()
    for tracker in trackers(path):
        began_s = time.monotonic()
        try:
            tracks, frames, verdicts, sentence = looked_at(path, tracker)
        except Exception:
            tracks, frames, verdicts, sentence = 0, 0, "traceback", traceback.format_exc()
        sentence = sentence.replace(f"{path}", path.name)
        took = f"{time.monotonic() - began_s:.1f}"
        inside = Path(*place.parts[1:])
        yield repository, inside, digest, tracker, tracks, frames, verdicts, sentence, took


def main() -> int:
    """Look at all films; 1 when one was decoded or failed otherwise than by a sentence."""
    parser = argparse.ArgumentParser(description="Real films that hold no message.")
    parser.add_argument("folder", type=Path)
    parser.add_argument("--out", type=Path, help="a table of what came out")
    asked = parser.parse_args()
    films = sorted(path for path in asked.folder.rglob("*") if path.is_file())
    rows = []
    for film in films:
        for row in rows_of(asked.folder, film):
            rows.append(row)
            print(*row[:2], *row[3:], sep=", ", flush=True)
    if asked.out is not None:
        write_result_csv(asked.out, f"python -m tests.audit.real_videos FOLDER --out {asked.out}", COLUMNS, rows)
    wrong = [row for row in rows if "decoded" in str(row[6]) or "\n" in str(row[7])]
    print(f"{len(films)} films, {len(rows)} looks, {len(wrong)} of them wrong")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
