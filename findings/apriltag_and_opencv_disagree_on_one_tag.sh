# pupil-apriltags 1.0.4.post11, opencv-python-headless 5.0.0.93: two readers of one AprilTag differ by half a pixel, the order of corners and half a turn
#
# Behaviour: the AprilTag library puts the centre of the first pixel at (0.5, 0.5), OpenCV at (0,
#   0), so all corners lie 0.5 px further right and down. AprilTag's corners run the other way
#   round, and its tag frame is turned by 180 degrees against the first side of OpenCV's corners.
# Guess: the same family, number and picture give the same corners in the same order.
# So: changing the reader within a recording, or calibrating with one and measuring with the other,
#   shifts every position by half a pixel and turns every heading round.
# Source: https://github.com/AprilRobotics/apriltag/issues/121 (pixel centres),
#   https://github.com/opencv/opencv-python/issues/1195 (orientation)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check --no-compile opencv-python-headless==5.0.0.93 pupil-apriltags==1.0.4.post11 numpy==2.4.6
venv/bin/python - <<'END'
import cv2, numpy as np
from pupil_apriltags import Detector
cv2.setNumThreads(1)
dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
cells = cv2.aruco.generateImageMarker(dictionary, 7, 8)
sheet = cv2.resize(cells, None, fx=60, fy=60, interpolation=cv2.INTER_NEAREST)
def picture(x, y, degrees, side=96, fine=8, size=240):
    a, s = np.deg2rad(degrees), side / 480
    m = s * np.array([[np.cos(a), -np.sin(a), 0], [np.sin(a), np.cos(a), 0]])
    m[:, 2] = np.array([x, y]) - m[:, :2] @ [239.5, 239.5]
    m *= fine
    m[:, 2] += (fine - 1) / 2
    big = cv2.warpAffine(sheet, m, (size * fine, size * fine), borderValue=255)
    return cv2.resize(big, (size, size), interpolation=cv2.INTER_AREA)
parameters = cv2.aruco.DetectorParameters()
parameters.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_SUBPIX
opencv, april = cv2.aruco.ArucoDetector(dictionary, parameters), Detector(families="tag36h11", nthreads=1)
def sense(c):  # +1: clockwise on the screen
    (ax, ay), (bx, by) = c[1] - c[0], c[2] - c[1]
    return int(np.sign(ax * by - ay * bx))
gaps, turns, orders = [], [], []
rng = np.random.default_rng(3)
for degrees in (10, 20, 30):
    for _ in range(8):
        p = picture(*(120 + rng.uniform(-1, 1, 2)), degrees)
        a = opencv.detectMarkers(p)[0][0].reshape(4, 2)
        tag = april.detect(p)[0]
        b, h = tag.corners, tag.homography
        x_axis = (h @ [1, 0, 1])[:2] / (h @ [1, 0, 1])[2] - (h @ [0, 0, 1])[:2] / (h @ [0, 0, 1])[2]
        gaps.append(b.mean(0) - a.mean(0))
        heading = [np.arctan2(v[1], v[0]) for v in (a[1] - a[0], x_axis)]
        turns.append(np.rad2deg((heading[1] - heading[0]) % (2 * np.pi)))
        orders.append((sense(a), sense(b)))
print(f"AprilTag minus OpenCV: {np.mean(gaps, 0).round(3)} px, heading {np.mean(turns):.1f} degrees, turning senses {set(orders)}")
assert np.allclose(np.mean(gaps, 0), 0.5, atol=0.05)
assert abs(np.mean(turns) - 180) < 1
assert set(orders) == {(1, -1)}
END
