# scipy 1.17.1, numpy 2.4.6: vonmises_fisher.logpdf is plus infinity from dimension 482 on, so wrong evidence wins
#
# Behaviour: with kappa 10 the log density at the mean direction is 810.17 in 481 dimensions and
#   +inf in 482, entropy is -800.17 and then nan. With kappa 100 it goes on to 600 dimensions and is
#   +inf at 1200. Only a warning about a division by zero is given. The true values are finite and
#   smooth.
# Guess: a density in logarithms is safe from underflow.
# So: +inf evidence beats every honest alternative. For directions of long windows (a message of 500
#   samples is one) compute the normaliser by the series in logarithms or a uniform expansion.
# Source: log(ive(dim / 2 - 1, kappa)) with ive underflowing to 0, in
#   https://github.com/scipy/scipy/blob/main/scipy/stats/_multivariate.py (vonmises_fisher_gen)
set -euo pipefail
tmp=$(mktemp -d)
trap 'rm -rf "$tmp"' EXIT
cd "$tmp"
python3 -m venv venv
venv/bin/pip install --quiet --disable-pip-version-check --no-compile scipy==1.17.1 numpy==2.4.6
venv/bin/python - <<'END'
import warnings
import numpy as np
from math import lgamma, log, pi
from scipy.stats import vonmises_fisher
warnings.simplefilter("ignore")
def truth(dim, kappa):  # log density at the mean: log of I_v(kappa) by its series, v = dim / 2 - 1
    v, terms = dim / 2 - 1, np.arange(400)
    logs = [(v + 2 * k) * log(kappa / 2) - lgamma(k + 1) - lgamma(v + k + 1) for k in terms]
    log_i = max(logs) + log(sum(np.exp(np.array(logs) - max(logs))))
    return v * log(kappa) - dim / 2 * log(2 * pi) - log_i + kappa
def value(dim, kappa):
    mean = np.eye(1, dim)[0]
    f = vonmises_fisher(mean, kappa)
    print(f"dimension {dim}, kappa {kappa}: logpdf {f.logpdf(mean):.2f}, entropy {f.entropy():.2f}, truth {truth(dim, kappa):.2f}")
    return f.logpdf(mean), f.entropy()
assert abs(value(481, 10)[0] - truth(481, 10)) < 1e-6
at, entropy = value(482, 10)
assert at == np.inf and np.isnan(entropy) and np.isfinite(truth(482, 10))
assert np.isfinite(value(600, 100)[0]) and value(1200, 100)[0] == np.inf
END
