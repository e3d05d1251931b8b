"""How a key's strength compares with those of keys that nobody holds, for detectors that know no exact law."""

from dataclasses import dataclass

import numpy as np

from mtm_audit.detectors.base import StrengthLaw
from mtm_audit.model.track import Floats
from mtm_onboard.protocol.codebook import Codebook
from mtm_onboard.protocol.key import Key
from mtm_onboard.protocol.keystream import SECRET_BYTES, stream

# Skewness of the Gumbel distribution, the limit of a maximum over many candidates.
_GUMBEL_SKEW = 1.1395
# Share of the decoys whose strengths show the tail of a log evidence.
_TAIL_PART = 0.15
# Smaller probabilities are all the same, 37 standard deviations from the mean.
_LEAST_TAIL = 1e-300


@dataclass(frozen=True)
class DecoyComparison:
    """The key's strength beside that of its decoys (decoys,), and the p-value that follows."""

    strength: float
    decoy_strengths: Floats
    p_value: float


def decoy_codebooks(key: Key, count: int, first_slot: int = 0) -> list[Codebook]:
    """Codebooks of keys that nobody holds, derived from this key so that every decode of a file says the same."""
    return [
        Codebook(stream(key.holding.decoy_seed(), "decoy", (number,), SECRET_BYTES), key.scheme, first_slot)
        for number in range(count)
    ]


def compare(strengths: Floats, law: StrengthLaw, maxima: int) -> DecoyComparison:
    """Compare strengths (1 + decoys,), the key's first, by the law that they follow without a message.

    `maxima` is over how many independent maxima each is a mean.
    """
    strength, decoys = float(strengths[0]), strengths[1:]
    if law == "log evidence":
        return weigh_log_evidence(strength, decoys)
    return weigh_mean_of_maxima(strength, decoys, maxima)


def weigh_log_evidence(strength: float, decoy_strengths: Floats) -> DecoyComparison:
    """Compare a log evidence with its decoys', whatever the shape of its law.

    Among the decoys the key's rank gives the p-value, which is exact because under the null the key is one of them.
    Beyond their upper part the tail is taken for exponential, as that of a log evidence is (Markov's inequality
    bounds it by exp(-strength)); with k excesses of mean m over the threshold the predictive probability of a further
    excess x is (1 + x / (k m))^-k, so that estimating the tail from few decoys costs what it should.
    """
    falling = np.sort(decoy_strengths)[::-1]
    count = len(falling)
    excesses = max(1, int(_TAIL_PART * count))
    threshold = falling[excesses]
    if strength > threshold:
        mean = max(float(np.mean(falling[:excesses] - threshold)), 1e-300)
        beyond = (1.0 + (strength - threshold) / (excesses * mean)) ** -excesses
        return DecoyComparison(strength, decoy_strengths, float((excesses + 1) / (count + 1) * beyond))
    # Between two decoys the rank is interpolated; below the last one the range of them all is taken to go on.
    points = np.concatenate([falling, [falling[-1] - np.ptp(falling) - 1e-300]])
    rank = float(np.interp(-strength, -points, np.arange(1, count + 2)))
    return DecoyComparison(strength, decoy_strengths, rank / (count + 1))


def weigh_mean_of_maxima(strength: float, decoy_strengths: Floats, maxima: int) -> DecoyComparison:
    """Compare the key's strength with its decoys'.

    Strengths are means of `maxima` maxima over candidates, so under the null they follow a Gumbel-like law whose
    skewness shrinks with the square root of that number. Location and scale are fitted to the decoys; that they
    are estimates from n decoys is paid for by Student's t with n - 1 degrees of freedom.
    """
    from scipy import stats

    count = len(decoy_strengths)
    centre, spread = float(np.mean(decoy_strengths)), float(np.std(decoy_strengths, ddof=1))
    standard = (strength - centre) / max(spread, 1e-300)
    skew = _GUMBEL_SKEW / np.sqrt(max(1, maxima))
    normal = _normal_of_skewed(standard, skew)
    p_value = float(stats.t.sf(normal / np.sqrt(1.0 + 1.0 / count), count - 1))
    return DecoyComparison(strength, decoy_strengths, p_value)


def _normal_of_skewed(standard: float, skew: float) -> float:
    """The standard normal quantile of the same probability as `standard` under a Pearson III law of that skew."""
    from scipy import stats

    # Each tail from its own side: the other one rounds to one, and the law itself ends somewhere below its mean.
    upper, lower = stats.pearson3.sf(standard, skew), stats.pearson3.cdf(standard, skew)
    if upper < lower:
        return float(stats.norm.isf(max(upper, _LEAST_TAIL)))
    return float(stats.norm.ppf(max(lower, _LEAST_TAIL)))
