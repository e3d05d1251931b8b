# av 18.1.0: an MP4's first frame time is cut to whole milliseconds, and all frames move with it
#
# Behaviour: 60 frames with exact times in a 1/90000 s time base are muxed into MP4. A first frame
#   at 1.2345 s is read back at 1.2340 s, one at 33.9 ms at 33 ms, and every later frame is early by
#   the same amount. A file that begins at 0 is exact, so a test with times from 0 shows nothing.
# Guess: the file's time base (1/90000 s) is the resolution of all its times.
# So: two cameras or a camera and a log, aligned by the times in MP4 files, are off by up to 1 ms
#   each, which is 2 degrees of phase at 5 Hz. Keep the start time outside the file, or begin at 0.
# Source: the start is written as an edit list in the movie's time scale, 1/1000 s by default:
#   https://github.com/FFmpeg/FFmpeg/blob/master/libavformat/movenc.c (option movie_timescale)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check --no-compile av==18.1.0
venv/bin/python - <<'END'
import av
from fractions import Fraction
def first_times(start):
    with av.open("film.mp4", "w") as c:
        s = c.add_stream("libx264", rate=30)
        s.width, s.height, s.pix_fmt = 64, 64, "yuv420p"
        s.codec_context.time_base = s.time_base = Fraction(1, 90000)
        for i in range(60):
            f = av.VideoFrame(64, 64, "yuv420p")
            for plane in f.planes:
                plane.update(bytes([i]) * plane.buffer_size)
            f.pts, f.time_base = round(start * 90000) + 3000 * i, Fraction(1, 90000)
            c.mux(s.encode(f))
        c.mux(s.encode(None))
    with av.open("film.mp4") as c:
        times = [f.time for f in c.decode(video=0)]
    print(f"first frame written at {1000 * start:.2f} ms, read at {1000 * times[0]:.2f} ms, "
          f"last one {1000 * (times[-1] - start - 59 / 30):+.3f} ms off")
    return times
assert first_times(0.0)[0] == 0
assert abs(first_times(0.0339)[0] - 0.033) < 1e-6
late = first_times(1.2345)
assert abs(late[0] - 1.234) < 1e-6 and abs(late[-1] - 1.2345 - 59 / 30 + 0.0005) < 2e-5
END
