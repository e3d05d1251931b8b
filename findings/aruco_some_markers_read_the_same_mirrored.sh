# opencv-python-headless 5.0.0.93, numpy 2.4.6: a mirrored film still shows valid ArUco markers, some under their own number
#
# Behaviour: in DICT_4X4_50 the markers 8, 9, 17 and 47 are read in a mirrored picture under their
#   own number; of the first 200 of DICT_4X4_1000 12 are, and 12 more under another number; of
#   DICT_ARUCO_ORIGINAL all are read. 6x6_250 and AprilTag 36h11 have none.
# Guess: a mirrored picture (a selfie camera, a ceiling mirror, a flipped sensor) gives no markers,
#   so markers that are read prove that the picture is not mirrored.
# So: in a mirrored film these markers turn the wrong way and nothing warns. Use a family without
#   mirror twins, or leave those numbers out.
# Source: markers are compared with the dictionary's four rotations, never with reflections:
#   https://github.com/opencv/opencv/blob/5.x/modules/objdetect/src/aruco/aruco_dictionary.cpp
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check --no-compile opencv-python-headless==5.0.0.93 numpy==2.4.6
venv/bin/python - <<'END'
import cv2, numpy as np
cv2.setNumThreads(1)
def mirrored(name):
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, name))
    detector = cv2.aruco.ArucoDetector(dictionary)
    read = {}
    numbers = range(min(200, len(dictionary.bytesList)))
    for number in numbers:
        sheet = cv2.aruco.generateImageMarker(dictionary, number, 80)
        sheet = cv2.copyMakeBorder(sheet, 30, 30, 30, 30, cv2.BORDER_CONSTANT, value=255)
        _, ids, _ = detector.detectMarkers(np.ascontiguousarray(sheet[:, ::-1]))
        if ids is not None:
            read[number] = int(np.ravel(ids)[0])
    same = [k for k, v in read.items() if k == v]
    print(f"{name}: {len(read)} of the first {len(numbers)} read in the mirror, {len(same)} as themselves: {same[:6]}")
    return read, same
read, same = mirrored("DICT_4X4_50")
assert same == [8, 9, 17, 47] and len(read) == 4
read, same = mirrored("DICT_4X4_1000")
assert read[0] == 871 and len(read) == 24 and len(same) == 12
read, same = mirrored("DICT_ARUCO_ORIGINAL")
assert len(read) == 200 and read[1] == 256
assert not mirrored("DICT_6X6_250")[0] and not mirrored("DICT_APRILTAG_36h11")[0]
END
