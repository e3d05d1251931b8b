# opencv-python-headless 5.0.0.93, numpy 2.4.6: ArUco contour and AprilTag refinement are over 20 times worse on markers aligned with the pixel grid
#
# Behaviour: with CORNER_REFINE_CONTOUR or CORNER_REFINE_APRILTAG the centre of a marker moved by
#   parts of a pixel scatters by 0.01 px when the marker is turned by 10 degrees, and by 0.2 px or
#   more when its sides run along the rows and columns: there it jumps in whole pixels. At 10
#   degrees CONTOUR also makes the marker 1 px smaller than it is, and APRILTAG puts all of it half
#   a pixel too far right and down; CORNER_REFINE_SUBPIX does neither.
# Guess: an axis-aligned marker is the easiest case, and line fitting the finest method.
# So: turn the markers, or the camera, by some degrees, or refine by CORNER_REFINE_SUBPIX, which
#   stays below 0.05 px at every angle. Do not mix films read with different refinements.
# Source: lines fitted to whole-pixel contours in
#   https://github.com/opencv/opencv/blob/5.x/modules/objdetect/src/aruco/aruco_detector.cpp
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check --no-compile opencv-python-headless==5.0.0.93 numpy==2.4.6
venv/bin/python - <<'END'
import cv2, numpy as np
cv2.setNumThreads(1)
dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
cells = cv2.aruco.generateImageMarker(dictionary, 3, 6)
sheet = cv2.resize(cells, None, fx=60, fy=60, interpolation=cv2.INTER_NEAREST)
def picture(x, y, degrees, rng, side=90, fine=4, size=320):
    a, s = np.deg2rad(degrees), side / 360
    m = s * np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0]])
    m[:, 2] = np.array([x, y]) - m[:, :2] @ [179.5, 179.5]
    m *= fine
    m[:, 2] += (fine - 1) / 2  # centre of a pixel is (0, 0), as in OpenCV
    big = cv2.warpAffine(sheet, m, (size * fine, size * fine), borderValue=255)
    p = cv2.resize(big, (size, size), interpolation=cv2.INTER_AREA) * 0.7 + 40
    p = cv2.GaussianBlur(p, (0, 0), 0.7) + rng.normal(size=p.shape)
    return np.clip(np.rint(p), 0, 255).astype(np.uint8)
scatter, offset, side = {}, {}, {}
for method in ("SUBPIX", "CONTOUR", "APRILTAG"):
    parameters = cv2.aruco.DetectorParameters()
    parameters.cornerRefinementMethod = getattr(cv2.aruco, "CORNER_REFINE_" + method)
    detector = cv2.aruco.ArucoDetector(dictionary, parameters)
    for degrees in (0, 10):
        rng, errors, sides = np.random.default_rng(5), [], []
        for _ in range(50):
            x, y = 160 + rng.uniform(-1, 1, 2)
            corners, ids, _ = detector.detectMarkers(picture(x, y, degrees, rng))
            four = corners[0].reshape(4, 2)
            errors.append(four.mean(0) - (x, y))
            sides.append(np.hypot(*(four - np.roll(four, 1, 0)).T).mean())
        scatter[method, degrees] = np.std(errors, 0).max()
        offset[method, degrees], side[method, degrees] = np.mean(errors), np.mean(sides)
        print(f"{method:8s} at {degrees:2d} degrees: centre scatters by {scatter[method, degrees]:.4f} px, "
              f"lies {offset[method, degrees]:+.2f} px off, side {side[method, degrees]:.2f} px of 90")
for method in ("CONTOUR", "APRILTAG"):
    assert scatter[method, 0] > 0.15 and scatter[method, 10] < 0.02
assert 0.35 < offset["APRILTAG", 10] < 0.6 and abs(side["APRILTAG", 10] - 90) < 0.4
assert abs(offset["CONTOUR", 10]) < 0.05 and 88.6 < side["CONTOUR", 10] < 89.4
assert scatter["SUBPIX", 0] < 0.06 and abs(offset["SUBPIX", 10]) < 0.05
END
