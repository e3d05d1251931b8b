# opencv-python-headless 4.12.0.88 and 5.0.0.93: detectMarkers returns ids as a column in OpenCV 4 and as a flat array in OpenCV 5
#
# Behaviour: three markers in one picture give ids of shape (3, 1) in 4.12 and (3,) in 5.0, while
#   the corners keep their shape (1, 4, 2). The usual "for i, in ids" or ids[k][0] works in 4 and
#   raises in 5; "for i in ids: seen[i]" works in 5 and raises in 4, since an array cannot be a key.
# Guess: the detector's results have one shape across versions, or all of them change alike.
# So: take numpy.ravel(ids), which reads both, and treat None (no marker) apart.
# Source: https://github.com/opencv/opencv-python/issues/1185 (reported for 4.13.0.90 already)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check --no-compile --target old opencv-python-headless==4.12.0.88 numpy==2.2.6
venv/bin/pip install --quiet --disable-pip-version-check --no-compile --target new opencv-python-headless==5.0.0.93 numpy==2.4.6
cat > ids.py <<'END'
import cv2, numpy as np
dictionary = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_50)
sheets = [cv2.copyMakeBorder(cv2.aruco.generateImageMarker(dictionary, k, 80), 30, 30, 30, 30,
                             cv2.BORDER_CONSTANT, value=255) for k in (3, 5, 7)]
corners, ids, _ = cv2.aruco.ArucoDetector(dictionary).detectMarkers(np.hstack(sheets))
def works(use):
    try:
        use()
        return "works"
    except (TypeError, IndexError) as e:
        return type(e).__name__
print(f"{cv2.__version__.split('.')[0]}: ids {ids.shape}, corners {corners[0].shape}, ids[0][0] {works(lambda: ids[0][0])}, "
      f"as a key {works(lambda: {i: 1 for i in ids})}, ravel {sorted(np.ravel(ids).tolist())}")
END
PYTHONPATH=old venv/bin/python ids.py | tee seen
PYTHONPATH=new venv/bin/python ids.py | tee -a seen
diff seen - <<'END'
4: ids (3, 1), corners (1, 4, 2), ids[0][0] works, as a key TypeError, ravel [3, 5, 7]
5: ids (3,), corners (1, 4, 2), ids[0][0] IndexError, as a key works, ravel [3, 5, 7]
END
