# av 18.1.0, numpy 2.4.6: x264, x265 and SVT-AV1 at everyday quality remove motion below a third of a pixel
#
# Behaviour: a soft disc swings sideways on a still, slightly noisy background. Of a swing of 0.3 px
#   rms at 4 Hz x264 keeps three quarters at CRF 18, half at its default of CRF 23 and a tenth at
#   CRF 28; x265 at CRF 28 and SVT-AV1 at CRF 35 keep next to nothing. Of 0.1 px next to nothing is
#   left at CRF 23. The same file keeps slow motion better than fast and large better than small.
# Guess: a compressed film is a noisier copy, and motion comes through at its true size.
# So: amplitudes must not be compared across films, sizes or frequencies; "no motion seen" in a
#   compressed film says nothing below some tenths of a pixel. Record at CRF 18 or better.
# Source: quality is decided per block by rate against distortion, see Rate control and the options
#   crf and mbtree of libx264 in https://ffmpeg.org/ffmpeg-codecs.html and
#   https://trac.ffmpeg.org/wiki/Encode/H.264
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check --no-compile av==18.1.0 numpy==2.4.6
venv/bin/python - <<'END'
import av, numpy as np
n, size, fps = 240, 128, 30
rng = np.random.default_rng(0)
yy, xx = np.mgrid[:size, :size].astype(float)
k = np.fft.fftfreq(size)
soft = np.exp(-2 * (np.pi * 3) ** 2 * (k[:, None] ** 2 + k[None] ** 2))
ground = np.fft.ifft2(np.fft.fft2(rng.normal(size=(size, size))) * soft).real
ground *= 12 / ground.std()
def disc(x):
    return 80 / (1 + np.exp((np.hypot(xx - x, yy - 64.2) - 12) / 2.5))
slope = np.gradient(disc(64.3), axis=1)
def film(x):
    return [np.clip(np.rint(110 + ground + disc(v) + 1.5 * rng.normal(size=(size, size))), 0, 255).astype(np.uint8) for v in x]
def coded(frames, codec, **options):
    with av.open("film.mp4", "w") as c:
        s = c.add_stream(codec, rate=fps, options=options)
        s.width = s.height = size
        s.pix_fmt, s.codec_context.thread_count = "yuv420p", 1
        for f in frames:
            c.mux(s.encode(av.VideoFrame.from_ndarray(f, format="gray").reformat(format="yuv420p")))
        c.mux(s.encode(None))
    with av.open("film.mp4") as c:
        return [f.to_ndarray(format="gray") for f in c.decode(video=0)]
def kept(frames, x, hertz):  # size of the measured swing over the true one
    mean, wave = np.mean(frames, 0), np.exp(-2j * np.pi * hertz * np.arange(n) / fps)
    y = np.array([-((f - mean) * slope).sum() / (slope ** 2).sum() for f in frames])
    return abs((wave * (y - y.mean())).sum() / (wave * (x - x.mean())).sum())
got = {}
for rms, hertz in ((0.3, 1), (0.3, 4), (0.1, 4)):
    x = 64.3 + rms * 2 ** 0.5 * np.sin(2 * np.pi * hertz * np.arange(n) / fps)
    frames = film(x)
    got[rms, hertz] = [kept(f, x, hertz) for f in (
        frames, coded(frames, "libx264", crf="18"), coded(frames, "libx264", crf="23"), coded(frames, "libx264", crf="28"),
        coded(frames, "libx265", crf="28", **{"x265-params": "log-level=none:pools=1"}),
        coded(frames, "libsvtav1", crf="35", preset="8", **{"svtav1-params": "lp=1"}))]
    print(f"{rms} px at {hertz} Hz, kept: uncoded, x264 18, 23, 28, x265 28, AV1 35:", np.round(got[rms, hertz], 2))
uncoded, c18, c23, c28, x265, av1 = got[0.3, 4]
assert uncoded > 0.97 and c18 > c23 > c28 > x265 and 0.6 < c18 < 0.92 and 0.3 < c23 < 0.7 and c28 < 0.3
assert x265 < 0.15 and av1 < 0.12
assert got[0.1, 4][2] < 0.25 and got[0.1, 4][0] > 0.97
assert got[0.3, 1][2] > c23 + 0.1
END
