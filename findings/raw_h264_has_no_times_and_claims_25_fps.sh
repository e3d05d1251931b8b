# av 18.1.0, opencv-python-headless 5.0.0.93: a raw H.264 file has no times, says 25 frames a second, and OpenCV announces minus 1.9e14 frames
#
# Behaviour: 100 frames encoded at 60 fps into a bare .h264 stream, as single-board cameras write
#   it. PyAV gives every frame the time None and the average rate 25; OpenCV gives 25 fps, a frame
#   count of about -192,153,584,101,141 and a position of 0 ms after every frame. The true 60 fps
#   stand in the stream and PyAV's guessed_rate knows them.
# Guess: a rate that is reported was read from the file; a count is missing as 0 or -1.
# So: motion at 3 Hz in such a film looks like 1.25 Hz. Ask for the rate, or take guessed_rate;
#   treat 25 from a file without times as unknown, and a negative count likewise.
# Source: default of the option framerate of the raw video demuxers, "25", in
#   https://github.com/FFmpeg/FFmpeg/blob/master/libavformat/rawdec.c and
#   https://ffmpeg.org/ffmpeg-formats.html#rawvideo
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check --no-compile av==18.1.0 opencv-python-headless==5.0.0.93
venv/bin/python - <<'END'
import av, cv2
with av.open("camera.h264", "w", format="h264") as c:
    s = c.add_stream("libx264", rate=60)
    s.width, s.height, s.pix_fmt = 64, 64, "yuv420p"
    for i in range(100):
        f = av.VideoFrame(64, 64, "yuv420p")
        for plane in f.planes:
            plane.update(bytes([2 * i]) * plane.buffer_size)
        c.mux(s.encode(f))
    c.mux(s.encode(None))
with av.open("camera.h264") as c:
    s = c.streams.video[0]
    rate, guessed = s.average_rate, s.guessed_rate
    times = [f.time for f in c.decode(video=0)]
capture = cv2.VideoCapture("camera.h264")
fps, count = capture.get(cv2.CAP_PROP_FPS), capture.get(cv2.CAP_PROP_FRAME_COUNT)
positions = []
while capture.read()[0]:
    positions.append(capture.get(cv2.CAP_PROP_POS_MSEC))
print(f"PyAV: {len(times)} frames, times {set(times)}, average rate {rate}, guessed rate {guessed}")
print(f"OpenCV: {len(positions)} frames, announced {count:.0f}, {fps} fps, positions {set(positions)} ms")
assert len(times) == 100 and set(times) == {None} and rate == 25 and guessed == 60
assert len(positions) == 100 and count < 0 and fps == 25 and set(positions) == {0.0}
END
