# filterpy 2.0.0, numpy 2.4.6: after update(None) a KalmanFilter reports the log-likelihood of a perfect measurement
#
# Behaviour: a filter follows 60 positions, then the marker is lost and update(None) is called, as
#   the documentation asks for a missing measurement. log_likelihood then is that of a residual of
#   exactly 0 under the last innovation covariance: +1.30 in each lost frame, as much as in the best
#   of the seen ones (0.92 on average), and the covariance used does not grow with the gap.
# Guess: a frame without a measurement adds nothing, so log_likelihood is 0 there.
# So: a sum of log_likelihood over a recording rewards lost frames. Add it only when there was a
#   measurement.
# Source: https://github.com/rlabbe/filterpy/blob/master/filterpy/kalman/kalman_filter.py (update,
#   log_likelihood)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check --no-compile filterpy==2.0.0 numpy==2.4.6
venv/bin/python - <<'END'
import numpy as np
from filterpy.kalman import KalmanFilter
rng = np.random.default_rng(0)
f = KalmanFilter(dim_x=2, dim_z=1)
f.F, f.H = np.array([[1, 0.1], [0, 1]]), np.array([[1.0, 0]])
f.R *= 0.01
f.Q *= 1e-4
seen, lost = [], []
for i in range(60):
    f.predict()
    f.update(0.1 * i + 0.1 * rng.normal())
    seen.append(f.log_likelihood)
for _ in range(20):
    f.predict()
    f.update(None)
    lost.append(f.log_likelihood)
    grown = (f.H @ f.P @ f.H.T + f.R).item()
print(f"seen frames: {np.mean(seen[20:]):.3f} on average, {np.max(seen[20:]):.3f} at most")
print(f"lost frames: {lost[0]:.3f} ... {lost[-1]:.3f}; innovation variance used {f.S.item():.4f}, by now {grown:.4f}")
assert np.allclose(lost, lost[0]) and lost[0] > 0.5
assert lost[0] > np.mean(seen[20:]) and lost[0] >= np.max(seen[20:]) - 0.05
assert grown > 1.5 * f.S.item()
END
