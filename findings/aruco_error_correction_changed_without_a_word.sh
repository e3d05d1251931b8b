# opencv-python-headless 4.12.0.88 and 5.0.0.93: AprilTags had no error correction and ARUCO_MIP_36H12 far too much; now both correct three cells
#
# Behaviour: in 4.12 an AprilTag 36h11 with one wrong cell is not found at all, while
#   DICT_ARUCO_MIP_36H12 accepts 7 wrong cells of 36 and so reads 57 of 250 markers of 4x4_1000 as
#   its own. In 5.0 AprilTags with up to 3 wrong cells are found and MIP_36H12 reads none of the
#   foreign ones.
# Guess: the dictionary with the largest distance is the safest one, and a detector of the same name
#   with the same parameters finds the same markers after an upgrade.
# So: detections in old and new films of the same scene are not comparable: say which OpenCV read
#   them. With 4.12, avoid MIP_36H12 beside other tags and expect dirty AprilTags to vanish.
# Source: https://github.com/opencv/opencv/pull/29034 ("fix maxCorrectionBits in predefined
#   dictionaries")
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check --no-compile --target old opencv-python-headless==4.12.0.88 numpy==2.2.6
venv/bin/pip install --quiet --disable-pip-version-check --no-compile --target new opencv-python-headless==5.0.0.93 numpy==2.4.6
cat > count.py <<'END'
import cv2, numpy as np
cv2.setNumThreads(1)
def family(name):
    return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, "DICT_" + name))
def sheet(name, number, wrong=0):
    n = family(name).markerSize + 2
    cells = cv2.aruco.generateImageMarker(family(name), number, n)
    for k in range(wrong):  # flip cells well apart from each other
        y, x = 1 + (5 * k) // (n - 2), 1 + (5 * k) % (n - 2)
        cells[y, x] = 255 - cells[y, x]
    big = cv2.resize(cells, None, fx=15, fy=15, interpolation=cv2.INTER_NEAREST)
    return cv2.copyMakeBorder(big, 40, 40, 40, 40, cv2.BORDER_CONSTANT, value=255)
def found(name, picture):
    ids = cv2.aruco.ArucoDetector(family(name)).detectMarkers(picture)[1]
    return None if ids is None else int(np.ravel(ids)[0])
april = [found("APRILTAG_36h11", sheet("APRILTAG_36h11", 7, w)) == 7 for w in range(5)]
mip = [found("ARUCO_MIP_36H12", sheet("ARUCO_MIP_36H12", 7, w)) == 7 for w in range(9)]
foreign = sum(found("ARUCO_MIP_36H12", sheet("4X4_1000", k)) is not None for k in range(250))
print(f"{cv2.__version__.split('.')[0]} AprilTag read with up to {sum(april) - 1} wrong cells, "
      f"MIP_36H12 with up to {sum(mip) - 1}, and {foreign} of 250 foreign markers taken for MIP_36H12")
END
PYTHONPATH=old venv/bin/python count.py | tee seen
PYTHONPATH=new venv/bin/python count.py | tee -a seen
diff seen - <<'END'
4 AprilTag read with up to 0 wrong cells, MIP_36H12 with up to 7, and 57 of 250 foreign markers taken for MIP_36H12
5 AprilTag read with up to 3 wrong cells, MIP_36H12 with up to 3, and 0 of 250 foreign markers taken for MIP_36H12
END
