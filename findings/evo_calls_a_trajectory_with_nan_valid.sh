# evo 1.38.1, numpy 2.4.6: one NaN line makes every statistic of evo NaN, after its own check called the trajectory valid
#
# Behaviour: a TUM file in which a motion capture system wrote "nan" for one lost frame of 20 is
#   read with 20 poses. trajectory.check() reports True and "ok" for each item. The absolute error's
#   mean, rmse and even median and min are NaN, and align() raises LinAlgError: SVD did not
#   converge.
# Guess: the reader drops or refuses such lines, check() finds them, and a median survives one of
#   them.
# So: drop lines with NaN before evo sees them, and say how many.
# Source: https://github.com/MichaelGrupp/evo/blob/master/evo/core/trajectory.py
#   (PoseTrajectory3D.check), https://github.com/MichaelGrupp/evo/wiki/Formats
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check --no-compile evo==1.38.1 numpy==2.4.6
venv/bin/python - <<'END'
import numpy as np
from evo.core import metrics, sync
from evo.tools import file_interface
def write(name, lost):
    with open(name, "w") as f:
        for i in range(20):
            x, y, z = ("nan",) * 3 if i == lost else (0.1 * i, 0.02 * i * i, 0.01 * (-1) ** i)
            f.write(f"{0.1 * i:.1f} {x} {y} {z} 0 0 0 1\n")
    return file_interface.read_tum_trajectory_file(name)
reference, lossy = write("reference.tum", None), write("lossy.tum", 7)
valid, details = lossy.check()
reference, lossy = sync.associate_trajectories(reference, lossy)
ape = metrics.APE(metrics.PoseRelation.translation_part)
ape.process_data((reference, lossy))
statistics = ape.get_all_statistics()
try:
    lossy.align(reference)
    aligned = "no error"
except np.linalg.LinAlgError as e:
    aligned = f"LinAlgError: {e}"
print(f"{lossy.num_poses} poses, check {valid} {details}")
print({k: float(v) for k, v in statistics.items()}, "align:", aligned)
assert lossy.num_poses == 20 and valid and set(details.values()) <= {"ok", "yes"}
assert all(np.isnan(v) for v in statistics.values()) and aligned.startswith("LinAlgError")
END
