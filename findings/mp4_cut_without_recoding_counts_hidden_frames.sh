# av 18.1.0, opencv-python-headless 5.0.0.93, imageio-ffmpeg 0.8.1: an MP4 cut without re-encoding announces frames that no player shows
#
# Behaviour: 240 frames at 30 fps with a key frame every 60 are cut at 2.5 s by "ffmpeg -ss 2.5 -c
#   copy". The new file announces 180 frames (PyAV and OpenCV alike), but 165 are decoded: the 15
#   from the last key frame to the cut lie in the file and an edit list hides them. The packets'
#   times start before zero, and reading packets instead of frames gives them all.
# Guess: the frame count of a clean, untouched MP4 header is the number of frames that come out.
# So: never allot or judge by the announced count ("frames are missing, the film is damaged"), and
#   never number the packets of such a file as if they were frames.
# Source: https://trac.ffmpeg.org/wiki/Seeking ("Seeking while doing a codec copy") and the edit
#   list handling in https://github.com/FFmpeg/FFmpeg/blob/master/libavformat/mov.c
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check --no-compile av==18.1.0 opencv-python-headless==5.0.0.93 imageio-ffmpeg==0.8.1
venv/bin/python - <<'END'
import subprocess, av, cv2, imageio_ffmpeg
with av.open("whole.mp4", "w") as c:
    s = c.add_stream("libx264", rate=30, options={"g": "60", "bf": "0", "sc_threshold": "0"})
    s.width, s.height, s.pix_fmt = 64, 64, "yuv420p"
    for i in range(240):
        f = av.VideoFrame(64, 64, "yuv420p")
        for plane in f.planes:
            plane.update(bytes([i]) * plane.buffer_size)
        c.mux(s.encode(f))
    c.mux(s.encode(None))
subprocess.run([imageio_ffmpeg.get_ffmpeg_exe(), "-loglevel", "error", "-ss", "2.5", "-i", "whole.mp4", "-c", "copy", "cut.mp4"], check=True)
def look(name):
    with av.open(name) as c:
        announced = c.streams.video[0].frames
        packets = [p.pts for p in c.demux(video=0) if p.pts is not None]
    with av.open(name) as c:
        decoded = sum(1 for _ in c.decode(video=0))
    capture, read = cv2.VideoCapture(name), 0
    count = int(capture.get(cv2.CAP_PROP_FRAME_COUNT))
    while capture.read()[0]:
        read += 1
    print(f"{name}: announced {announced}, packets {len(packets)} from time {min(packets)}, decoded {decoded}; "
          f"OpenCV announces {count}, reads {read}")
    return announced, len(packets), min(packets), decoded, count, read
assert look("whole.mp4") == (240, 240, 0, 240, 240, 240)
announced, packets, first, decoded, count, read = look("cut.mp4")
assert announced == packets == count == 180 and decoded == read == 165 and first < 0
END
