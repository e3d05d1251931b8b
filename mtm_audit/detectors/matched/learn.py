"""The plant of a type of robot, learnt from a recording whose message is known to be there."""

from collections.abc import Sequence

import numpy as np

from mtm_audit.detectors.base import Observation, Reading
from mtm_audit.detectors.matched.estimate import estimate, fit_recording_noise
from mtm_audit.detectors.matched.motion import uniform_motion
from mtm_audit.detectors.matched.profile import PlantProfile
from mtm_audit.detectors.matched.windows import make_windows
from mtm_onboard.protocol.codebook import Codebook


def learn_profile(codebook: Codebook, observations: Sequence[Observation], readings: Sequence[Reading]) -> PlantProfile:
    """What all observations together show of one plant, given a reading of each, which says where its windows lie.

    Gains are each observation's own and are not kept. Raises MtmError when a recording is too short.
    """
    motions = [uniform_motion(observation.glimpse, codebook.scheme.band_hz[1]) for observation in observations]
    windows = []
    for row, (observation, reading) in enumerate(zip(observations, readings, strict=True)):
        length_s = codebook.scheme.window_ticks(observation.channel) / reading.timing.rate_hz
        numbers = np.rint((reading.window_starts_s - reading.timing.onset_s) / length_s).astype(int).tolist()
        windows += make_windows(codebook, observation.channel, motions[row], reading.timing, row, numbers)
    noise = fit_recording_noise(motions, [motion.velocities for motion in motions])
    return PlantProfile(estimate(windows, motions, noise).plants)
