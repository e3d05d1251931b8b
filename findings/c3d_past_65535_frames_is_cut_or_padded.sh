# ezc3d 1.7.2, c3d 0.6.0, numpy 2.4.6: a C3D file of 70,000 frames is read as 65,535, as none or as 70,016, and nothing is raised
#
# Behaviour: 70,000 frames at 100 Hz (under 12 minutes). Written by ezc3d: ezc3d reads 65,535 of
#   them back; the c3d package announces 65,535 and gives 0, with a warning. Written by the c3d
#   package: it reads its own 70,000, ezc3d reads 70,016, the last 16 being the padding of the
#   file's last block as points. 40,000 frames are read right by all.
# Guess: the number of frames is stored, and a format of motion capture holds an hour.
# So: check the number of frames that come out against duration times rate, in both directions; save
#   recordings longer than 65,535 frames in pieces.
# Source: 16-bit frame numbers in the header, https://github.com/pyomeca/ezc3d/issues/372 and
#   https://github.com/pyomeca/ezc3d/issues/308; https://github.com/EmbodiedCognition/py-c3d
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check --no-compile ezc3d==1.7.2 c3d==0.6.0 numpy==2.4.6
venv/bin/python - <<'END'
import warnings
import c3d, ezc3d, numpy as np
warnings.simplefilter("ignore")
def read(name):
    by_ezc3d = ezc3d.c3d(name)["data"]["points"].shape[2]
    with open(name, "rb") as f:
        reader = c3d.Reader(f)
        announced, by_c3d = reader.frame_count, sum(1 for _ in reader.read_frames())
    print(f"{name}: ezc3d reads {by_ezc3d} frames; c3d announces {announced} and reads {by_c3d}")
    return by_ezc3d, announced, by_c3d
def write(n):
    f = ezc3d.c3d()
    points = np.ones((4, 1, n))
    points[0, 0] = np.arange(n)
    f["parameters"]["POINT"]["RATE"]["value"] = [100.0]
    f["parameters"]["POINT"]["LABELS"]["value"] = ("a",)
    f["data"]["points"] = points
    f.write(f"ezc3d_{n}.c3d")
    writer = c3d.Writer(point_rate=100)
    writer.add_frames([(np.ones((1, 5)) * [1, 2, 3, 0, 0], np.zeros((0, 0)))] * n)
    writer.set_point_labels(["a"])
    with open(f"c3d_{n}.c3d", "wb") as out:
        writer.write(out)
    return read(f"ezc3d_{n}.c3d"), read(f"c3d_{n}.c3d")
assert write(40_000) == ((40_000,) * 3, (40_000,) * 3)
assert write(70_000) == ((65_535, 65_535, 0), (70_016, 70_000, 70_000))
END
