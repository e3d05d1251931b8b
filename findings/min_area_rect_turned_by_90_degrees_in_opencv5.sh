# opencv-python-headless 4.12.0.88 and 5.0.0.93: minAreaRect gives one robot another angle and swapped sides after the upgrade
#
# Behaviour: for one rectangle of 100 x 50 turned by 30 degrees OpenCV 4.12 gives sides (100, 50)
#   and 30 degrees, OpenCV 5.0 sides (50, 100) and -60. 4.12 counts in (0, 90], 5.0 in [-90, 0) as
#   before 4.5.1. An unturned rectangle is 90 in one and -90 in the other, never 0.
# Guess: an angle's convention is fixed within a library, at least since it was changed in 4.5.1.
# So: a heading taken from the angle jumps by a quarter turn with the installed version. Take the
#   direction of the longer side from boxPoints, which is the same in both.
# Source: https://github.com/opencv/opencv/pull/28051 ("Correct minAreaRect angle to be in range
#   [-90, 0)"), https://github.com/opencv/opencv/issues/19472
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check --no-compile --target old opencv-python-headless==4.12.0.88 numpy==2.2.6
venv/bin/pip install --quiet --disable-pip-version-check --no-compile --target new opencv-python-headless==5.0.0.93 numpy==2.4.6
cat > angle.py <<'END'
import cv2, numpy as np
def rectangle(degrees):
    a = np.deg2rad(degrees)
    turn = np.array([[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]])
    return (np.array([(0, 0), (100, 0), (100, 50), (0, 50)]) @ turn.T).astype(np.float32)
for degrees in (0, 30, 60):
    _, sides, angle = rect = cv2.minAreaRect(rectangle(degrees))
    box = cv2.boxPoints(rect)
    edges = np.roll(box, -1, 0) - box
    x, y = max(edges, key=lambda e: np.hypot(*e))
    print(f"turned by {degrees}: sides {round(sides[0])} x {round(sides[1])}, angle {round(angle)}, "
          f"longer side of boxPoints {round(np.rad2deg(np.arctan2(y, x))) % 180}")
END
PYTHONPATH=old venv/bin/python angle.py | tee seen
diff seen - <<'END'
turned by 0: sides 50 x 100, angle 90, longer side of boxPoints 0
turned by 30: sides 100 x 50, angle 30, longer side of boxPoints 30
turned by 60: sides 100 x 50, angle 60, longer side of boxPoints 60
END
PYTHONPATH=new venv/bin/python angle.py | tee seen
diff seen - <<'END'
turned by 0: sides 50 x 100, angle -90, longer side of boxPoints 0
turned by 30: sides 50 x 100, angle -60, longer side of boxPoints 30
turned by 60: sides 50 x 100, angle -30, longer side of boxPoints 60
END
