# av 18.1.0, opencv-python-headless 5.0.0.93: an AVI with uneven frame times announces thousands of frames for sixty
#
# Behaviour: 60 Motion JPEG frames with times in milliseconds, 17 to 50 ms apart, are muxed into
#   AVI. The file announces one frame for each millisecond, about 2,000, and 1,000 frames a second,
#   in PyAV and OpenCV alike; 60 are decoded, with the right times. AVI has one constant rate, and
#   the gaps are filled with empty chunks that count.
# Guess: an AVI holds constant-rate film only, so either the times or the muxing would be refused.
# So: neither the count nor the rate of an AVI may be used for times; take the frames' own times.
# Source: empty packets for skipped frames, in
#   https://github.com/FFmpeg/FFmpeg/blob/master/libavformat/avienc.c
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check --no-compile av==18.1.0 opencv-python-headless==5.0.0.93
venv/bin/python - <<'END'
import av, cv2
from fractions import Fraction
steps = [33, 34, 50, 17, 40] * 12
times = [sum(steps[:i]) for i in range(60)]
with av.open("film.avi", "w") as c:
    s = c.add_stream("mjpeg", rate=30)
    s.width, s.height, s.pix_fmt = 64, 64, "yuvj420p"
    s.codec_context.time_base = s.time_base = Fraction(1, 1000)
    for i, t in enumerate(times):
        f = av.VideoFrame(64, 64, "yuvj420p")
        for plane in f.planes:
            plane.update(bytes([3 * i]) * plane.buffer_size)
        f.pts, f.time_base = t, Fraction(1, 1000)
        c.mux(s.encode(f))
    c.mux(s.encode(None))
with av.open("film.avi") as c:
    s = c.streams.video[0]
    announced, rate = s.frames, s.average_rate
    decoded = [round(1000 * f.time) for f in c.decode(video=0)]
capture, read = cv2.VideoCapture("film.avi"), 0
count, fps = capture.get(cv2.CAP_PROP_FRAME_COUNT), capture.get(cv2.CAP_PROP_FPS)
while capture.read()[0]:
    read += 1
print(f"PyAV: announced {announced} at {rate} a second, decoded {len(decoded)}, times right: {decoded == times}")
print(f"OpenCV: announced {count:.0f} at {fps} a second, read {read}")
assert announced > 1900 and rate == 1000 and len(decoded) == 60 and decoded == times
assert count == announced and fps == 1000 and read == 60
END
