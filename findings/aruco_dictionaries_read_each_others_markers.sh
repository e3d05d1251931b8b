# opencv-python-headless 5.0.0.93, numpy 2.4.6: a 1000-word 4x4 dictionary reads AprilTags, and the families share numbers
#
# Behaviour: clean pictures of one marker family are read as valid markers of another one: AprilTag
#   36h11 number 32 as 4x4_1000 number 391, AprilTag 16h5 numbers 16 and 18 as 227 and 854, six of
#   the first 250 of 4x4_1000 as AprilTag 16h5, 6x6 number 198 as AprilTag 25h9 number 18. All of
#   4x4_50 are read by 4x4_1000, under the same numbers.
# Guess: families of different sizes cannot be confused, the more so with error correction checked.
# So: "a marker of our family was seen" is no proof that it is one of ours where other tags hang in
#   the room. Take the smallest dictionary that suffices and ignore numbers that were not handed
#   out.
# Source:
#   https://github.com/opencv/opencv/blob/5.x/modules/objdetect/src/aruco/predefined_dictionaries.hpp
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check --no-compile opencv-python-headless==5.0.0.93 numpy==2.4.6
venv/bin/python - <<'END'
import cv2, numpy as np
cv2.setNumThreads(1)
def family(name):
    return cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, "DICT_" + name))
def cross(shown, reader):
    detector, read = cv2.aruco.ArucoDetector(family(reader)), {}
    for number in range(min(250, len(family(shown).bytesList))):
        sheet = cv2.aruco.generateImageMarker(family(shown), number, 120)
        sheet = cv2.copyMakeBorder(sheet, 40, 40, 40, 40, cv2.BORDER_CONSTANT, value=255)
        _, ids, _ = detector.detectMarkers(sheet)
        if ids is not None:
            read[number] = int(np.ravel(ids)[0])
    print(f"{shown} shown, {reader} expected: {len(read)} read", dict(list(read.items())[:6]))
    return read
assert cross("APRILTAG_36h11", "4X4_1000") == {32: 391}
assert cross("APRILTAG_16h5", "4X4_1000") == {16: 227, 18: 854}
assert len(cross("4X4_1000", "APRILTAG_16h5")) == 6
assert cross("6X6_250", "APRILTAG_25h9") == {198: 18}
assert all(k == v for k, v in cross("4X4_50", "4X4_1000").items())
assert not cross("APRILTAG_36h11", "6X6_250")
END
