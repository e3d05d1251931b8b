# scipy 1.17.1, numpy 2.4.6, mpmath 1.3.0: hyp0f1(v, negative) is inf from v = 172 on, where the answer is 0.75
#
# Behaviour: scipy.special.hyp0f1(v, -50) is 0.746 for v = 171 and inf for v = 172 and more; the
#   true value is 0.748 and tends to 1. Positive arguments of the same size are right. The gamma
#   function overflows at 172 and multiplies a Bessel value that has nearly vanished.
# Guess: a series that converges this fast (its terms fall like 50/v) has no trouble, and least of
#   all for large v.
# So: characteristic functions and likelihoods of directions in more than 342 dimensions (v = dim /
#   2) break. Sum the series itself for v > 100, or use mpmath.
# Source: https://github.com/scipy/scipy/blob/main/scipy/special/_hyp0f1.pxd (its branch for
#   negative arguments has no logarithms and no expansion, the one for positive ones has both)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check --no-compile scipy==1.17.1 numpy==2.4.6 mpmath==1.3.0
venv/bin/python - <<'END'
import mpmath, numpy as np
from scipy.special import hyp0f1
for v in (170.0, 171.0, 172.0, 250.0):
    for z in (-50.0, 50.0):
        got, want = float(hyp0f1(v, z)), float(mpmath.hyp0f1(v, z))
        print(f"hyp0f1({v:.0f}, {z:.0f}) = {got:.6f}, truth {want:.6f}")
        if v > 171 and z < 0:
            assert not np.isfinite(got) and 0.7 < want < 1
        else:
            assert abs(got - want) < 1e-9
END
