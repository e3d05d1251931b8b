# opencv-python-headless 5.0.0.93, numpy 2.4.6: a marker well inside a picture is not found when the border cuts what it lies on
#
# Behaviour: a marker of 42 px on a dark plate is read in the whole picture, and not in a cut-out that
#   leaves 8 to 20 px around it and goes through the plate, far though that is from the border. With
#   minDistanceToBorder = 0 instead of 3 it is read in every cut-out.
# Guess: minDistanceToBorder leaves out markers that are near the border, and no others.
# So: searching in windows around the last place of a marker loses it again and again where the
#   robot's outline is cut. Set minDistanceToBorder to 0 and leave out markers that touch the border
#   yourself.
# Source: minDistanceToBorder in
#   https://docs.opencv.org/4.x/d1/dcd/structcv_1_1aruco_1_1DetectorParameters.html
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
python3 -m venv "$tmp/venv"
"$tmp/venv/bin/pip" install --quiet --disable-pip-version-check --no-compile opencv-python-headless==5.0.0.93 numpy==2.4.6
"$tmp/venv/bin/python" - <<'END'
import cv2, numpy as np
cv2.setNumThreads(1)
dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
picture = np.full((240, 240), 180, np.uint8)
picture[80:160, 84:156] = 50                       # the robot
picture[92:148, 92:148] = 245                      # the marker's white margin
picture[99:141, 99:141] = cv2.aruco.generateImageMarker(dictionary, 1, 42)
picture = cv2.GaussianBlur(picture, (0, 0), 0.8)
def read(margin, border):
    parameters = cv2.aruco.DetectorParameters()
    parameters.minDistanceToBorder = border
    window = np.ascontiguousarray(picture[99 - margin:141 + margin, 99 - margin:141 + margin])
    return cv2.aruco.ArucoDetector(dictionary, parameters).detectMarkers(window)[1] is not None
seen = {border: [m for m in range(6, 90, 2) if read(m, border)] for border in (3, 0)}
lost = sorted(set(seen[0]) - set(seen[3]))
print(f"found with every margin: {len(seen[0]) == 42}; with the default border lost at margins of {lost} px")
assert len(seen[0]) == 42
assert lost and min(lost) >= 8 and max(lost) <= 40
END
