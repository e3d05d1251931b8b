# av 18.1.0, numpy 2.4.6: after x264 a still object's measured noise is as large as before but lies below 1 Hz
#
# Behaviour: a still disc, filmed with white sensor noise, is located with white scatter. After x264
#   at CRF 23 the scatter has one to two times that rms, but over 90 % of its power lies below 1 Hz
#   instead of 6 %, and frame-to-frame differences show a quarter of it or less.
# Guess: an encoder adds or removes noise, and what is left is about white; differences of
#   neighbouring frames tell its size.
# So: noise estimated from frame differences is several times too small on coded film, and slow
#   wander is no sign of a moving robot or camera. Take the noise from the file's own spectrum.
# Source: https://code.videolan.org/videolan/x264 (encoder/analyse.c, skipped blocks repeat the last
#   picture until the difference is worth coding); https://ffmpeg.org/ffmpeg-codecs.html
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check --no-compile av==18.1.0 numpy==2.4.6
venv/bin/python - <<'END'
import av, numpy as np
n, size, fps = 600, 128, 30
rng = np.random.default_rng(0)
yy, xx = np.mgrid[:size, :size].astype(float)
k = np.fft.fftfreq(size)
soft = np.exp(-2 * (np.pi * 3) ** 2 * (k[:, None] ** 2 + k[None] ** 2))
ground = np.fft.ifft2(np.fft.fft2(rng.normal(size=(size, size))) * soft).real
disc = 80 / (1 + np.exp((np.hypot(xx - 64.3, yy - 64.2) - 12) / 2.5))
scene, slope = 110 + ground * 12 / ground.std() + disc, np.gradient(disc, axis=1)
frames = [np.clip(np.rint(scene + 1.5 * rng.normal(size=scene.shape)), 0, 255).astype(np.uint8) for _ in range(n)]
def coded(crf):
    with av.open("film.mp4", "w") as c:
        s = c.add_stream("libx264", rate=fps, options={"crf": crf})
        s.width = s.height = size
        s.pix_fmt, s.codec_context.thread_count = "yuv420p", 1
        for f in frames:
            c.mux(s.encode(av.VideoFrame.from_ndarray(f, format="gray").reformat(format="yuv420p")))
        c.mux(s.encode(None))
    with av.open("film.mp4") as c:
        return [f.to_ndarray(format="gray") for f in c.decode(video=0)]
def measure(name, pictures):
    mean = np.mean(pictures, 0)
    y = np.array([-((f - mean) * slope).sum() / (slope ** 2).sum() for f in pictures])
    power, hertz = np.abs(np.fft.rfft(y - y.mean())) ** 2, np.fft.rfftfreq(n, 1 / fps)
    low, steps = power[(hertz > 0) & (hertz < 1)].sum() / power.sum(), np.diff(y).std() / 2 ** 0.5
    print(f"{name}: {1000 * y.std():.1f} thousandths of a pixel rms, {100 * low:.0f} % below 1 Hz, by differences {1000 * steps:.1f}")
    return y.std(), low, steps
raw, c18, c23 = measure("uncoded", frames), measure("CRF 18", coded("18")), measure("CRF 23", coded("23"))
assert raw[1] < 0.1 and abs(raw[2] / raw[0] - 1) < 0.1, "white before"
assert 0.5 < c23[0] / raw[0] < 2.5, "the size is of the same order"
assert c18[1] > 0.3 and c23[1] > 0.85, "the power moves below 1 Hz"
assert c23[2] < c23[0] / 3, "differences see little of it"
END
