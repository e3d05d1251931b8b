# av 18.1.0, opencv-python-headless 5.0.0.93: a cover muxed into Matroska loses its mark and stands there as a film of one picture
#
# Behaviour: a JPEG cover marked "attached_pic" and 20 frames of H.264 are muxed into MP4 and into
#   Matroska by the same code. MP4 gives the mark back. In Matroska the cover is a video stream with
#   no disposition at all, and where it was muxed first, PyAV's decode(video=0) and OpenCV read one
#   picture and end, without an error. The film behind it is whole.
# Guess: a cover is told by its disposition, and stream 0 of the kind "video" is the film.
# So: skip streams of still-picture codecs when another one is there, marked or not; one frame read
#   without an error is no proof that a file holds one frame.
# Source: Matroska keeps covers as attachments (https://www.matroska.org/technical/attachments.html);
#   the muxer writes the tracks it is given and has no place for attached_pic:
#   https://github.com/FFmpeg/FFmpeg/blob/master/libavformat/matroskaenc.c
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check --no-compile av==18.1.0 opencv-python-headless==5.0.0.93
venv/bin/python - <<'END'
import av, cv2
from av.stream import Disposition
def look(name):
    with av.open(name, "w") as c:
        cover = c.add_stream("mjpeg", rate=1)
        cover.width, cover.height, cover.pix_fmt = 64, 64, "yuvj420p"
        cover.disposition = Disposition.attached_pic
        film = c.add_stream("libx264", rate=30)
        film.width, film.height, film.pix_fmt = 64, 64, "yuv420p"
        c.mux(cover.encode(av.VideoFrame(64, 64, "yuvj420p")))
        c.mux(cover.encode(None))
        for _ in range(20):
            c.mux(film.encode(av.VideoFrame(64, 64, "yuv420p")))
        c.mux(film.encode(None))
    with av.open(name) as c:
        streams = [(s.codec_context.name, bool(s.disposition & Disposition.attached_pic)) for s in c.streams.video]
        first = sum(1 for _ in c.decode(video=0))
    with av.open(name) as c:
        film = sum(1 for _ in c.decode(next(s for s in c.streams.video if s.codec_context.name == "h264")))
    capture, read = cv2.VideoCapture(name), 0
    while capture.read()[0]:
        read += 1
    print(f"{name}: streams {streams}; decode(video=0) {first} frames, the film {film}, OpenCV {read}")
    return streams, first, film, read
assert look("film.mp4") == ([("h264", False), ("mjpeg", True)], 20, 20, 20)
assert look("film.mkv") == ([("mjpeg", False), ("h264", False)], 1, 20, 1)
END
