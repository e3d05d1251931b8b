# av 18.1.0, opencv-python-headless 5.0.0.93: H.264 with B-frames in AVI shows the right order with times that run backwards
#
# Behaviour: 60 H.264 frames with B-frames are muxed into AVI. The pictures come out in the right
#   order, but their pts run 1, 4, 3, 5, 2, 8, ...: nearly half of the steps go backwards. The
#   frames' dts run evenly. OpenCV hides the disorder, but begins at 67 ms and gives the last frames
#   the position 0.
# Guess: pts is the time at which to show a frame, whatever the container; dts is the odd one.
# So: sorting by pts shuffles the film and differences of pts become negative. In AVI number the
#   frames by their order (or take dts) and say that the times are made up.
# Source: AVI stores no presentation times; the demuxer knows decoding order only:
#   https://github.com/FFmpeg/FFmpeg/blob/master/libavformat/avidec.c
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check --no-compile av==18.1.0 opencv-python-headless==5.0.0.93
venv/bin/python - <<'END'
import av, cv2
with av.open("film.avi", "w") as c:
    s = c.add_stream("libx264", rate=30, options={"bf": "3", "crf": "1"})
    s.width, s.height, s.pix_fmt = 64, 64, "yuv420p"
    for i in range(60):
        f = av.VideoFrame(64, 64, "yuv420p")
        for plane in f.planes:
            plane.update(bytes([40 + 3 * i]) * plane.buffer_size)
        c.mux(s.encode(f))
    c.mux(s.encode(None))
with av.open("film.avi") as c:
    frames = [(bytes(f.planes[0])[0], f.pts, f.dts) for f in c.decode(video=0)]
grey, pts, dts = zip(*frames)
back = sum(b < a for a, b in zip(pts, pts[1:]))
print(f"decoded {len(frames)}, pts {pts[:9]}..., {back} steps back; dts {dts[:6]}...")
capture, positions = cv2.VideoCapture("film.avi"), []
while capture.read()[0]:
    positions.append(capture.get(cv2.CAP_PROP_POS_MSEC))
print(f"OpenCV: {len(positions)} frames, positions {positions[0]:.1f}, {positions[1]:.1f} ... {positions[-1]:.1f} ms")
assert list(grey) == sorted(grey) and len(set(grey)) == 60, "the pictures are in order"
assert back > 10 and pts[0] > 0 and any(d is not None for d in dts)
steps = {b - a for a, b in zip(dts, dts[1:]) if a is not None and b is not None}
assert steps == {1}, steps
assert abs(positions[0] - 66.7) < 0.1 and positions[-1] == 0
END
