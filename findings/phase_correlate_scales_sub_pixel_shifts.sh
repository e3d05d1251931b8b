# opencv-python-headless 5.0.0.93, numpy 2.4.6: phaseCorrelate scales sub-pixel shifts by 0.8 to 1.35
#
# Behaviour: cv2.phaseCorrelate is right for whole pixels, but a shift of a quarter pixel comes out
#   as anything from 0.8 to 1.35 of itself (and as nothing in a noise-free picture without a
#   window), depending on how smooth and how noisy the picture is. The scale is systematic:
#   averaging over frames keeps it.
# Guess: a phase method is unbiased, noise only adds scatter, and a window only helps.
# So: motion amplitudes below a pixel are not to be measured with it, nor compared between films.
#   Pyramidal Lucas-Kanade on the same pictures stays within 4 %.
# Source: weighted centroid over 5 x 5 cells around the peak, in
#   https://github.com/opencv/opencv/blob/5.x/modules/imgproc/src/phasecorr.cpp and
#   https://github.com/opencv/opencv/issues/9158
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install --quiet --disable-pip-version-check --no-compile opencv-python-headless==5.0.0.93 numpy==2.4.6
"$tmp/venv/bin/python" - <<'END'
import cv2, numpy as np
cv2.setNumThreads(1)
rng = np.random.default_rng(0)
n, shift = 256, 0.25
k, l = np.fft.fftfreq(n)[:, None], np.fft.fftfreq(n)[None]
spectrum = np.fft.fft2(rng.normal(size=(n, n))) * np.exp(-2 * (np.pi * 2.0) ** 2 * (k * k + l * l))
def picture(d):  # a smooth texture, moved by exactly d pixels
    p = np.fft.ifft2(spectrum * np.exp(-2j * np.pi * l * d)).real
    return p / np.fft.ifft2(spectrum).real.std() * 30 + 128
window = cv2.createHanningWindow((n, n), cv2.CV_64F)
out = {}
for noise in (0, 2, 10):
    rows = []
    for _ in range(8):
        a, b = (picture(d) + noise * rng.normal(size=(n, n)) for d in (0, shift))
        a8, b8 = (np.clip(np.rint(x), 0, 255).astype(np.uint8) for x in (a, b))
        points = cv2.goodFeaturesToTrack(a8, 200, 0.01, 8)
        moved, ok, _ = cv2.calcOpticalFlowPyrLK(a8, b8, points, None)
        d = (moved - points).reshape(-1, 2)[ok.ravel() == 1, 0]
        rows.append((cv2.phaseCorrelate(a, b)[0][0], cv2.phaseCorrelate(a, b, window)[0][0], np.median(d)))
    out[noise] = np.mean(rows, 0) / shift
    print(f"noise {noise:2d}: phaseCorrelate {out[noise][0]:6.3f}, with a window {out[noise][1]:6.3f}, "
          f"Lucas-Kanade {out[noise][2]:6.3f} of the true shift of {shift} px")
whole = cv2.phaseCorrelate(picture(0), picture(3))[0][0]
print(f"a shift of 3 px reads {whole:.3f}")
assert abs(whole - 3) < 0.01
assert out[0][1] > 1.2, "clean, with a window: read too large"
assert out[2][0] > 1.08, "a little noise: read too large"
assert out[10][0] < 0.88, "more noise: read too small"
assert all(abs(out[i][2] - 1) < 0.05 for i in out), "Lucas-Kanade is near the truth"
END
