import re
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis.extra.numpy import arrays
from hypothesis.strategies import floats

from mtm_audit.detectors.matched.estimate import estimate, fit_recording_noise
from mtm_audit.detectors.matched.plants import COARSE, FINE
from mtm_audit.detectors.matched.profile import PlantProfile, load_profile, log_prior, profile_text, save_profile
from mtm_onboard.protocol import MtmError
from tests.audit.detectors.matched.fleet_motion import estimated, fleet_run, motions_of, windows_of

COUNT = len(FINE.taps)
EVEN = f"weight = {1.0 / COUNT!r}"


def certain_of(plant):
    return PlantProfile(np.eye(COUNT)[plant])


# One plant almost certain and the others all rounded alike is what loses most when weights are written short.
@given(arrays(np.float64, COUNT, elements=floats(1e-9, 1.0)))
@example(np.where(np.arange(COUNT) == 0, 1.0, 0.0101))
def test_a_file_gives_back_what_was_written(tmp_path_factory, weights):
    path = tmp_path_factory.mktemp("profile") / "robot.profile"
    save_profile(PlantProfile(weights / weights.sum()), path)
    assert load_profile(path).weights == pytest.approx(weights / weights.sum(), rel=1e-14, abs=0.0)


def test_without_a_profile_times_of_returning_are_equally_likely():
    prior = np.exp(log_prior(None, COARSE))
    for return_s in (0.1, 0.3, np.inf):
        own = prior[COARSE.returns_s == return_s]
        assert own.sum() == pytest.approx(1 / 3)
        assert own == pytest.approx(own[0])


@pytest.mark.parametrize("plant", range(0, COUNT, 5))
@pytest.mark.parametrize("family", [FINE, COARSE], ids=["fine", "coarse"])
def test_a_profile_favours_what_is_near_and_rules_nothing_out(plant, family):
    prior = np.exp(log_prior(certain_of(plant), family))
    best = int(np.argmax(prior))
    assert prior.sum() == pytest.approx(1.0)
    assert prior[best] > 0.9
    # A tenth is never given away, and a tenth of that is of the plants with a notch.
    assert prior.min() > 0.9 * 0.01 / COUNT
    group_delays_s = family.delays_s + family.lags_s
    assert abs(group_delays_s[best] - FINE.delays_s[plant] - FINE.lags_s[plant]) < 0.16


def test_a_wrong_profile_only_delays_what_a_recording_shows():
    run = fleet_run(31, message_ticks=300)
    learnt = estimated(run)
    assert learnt.plants.sum() == pytest.approx(1.0)
    # The simulated chassis follows after a delay and a lag of together about a fifth of a second.
    assert learnt.plants @ (FINE.delays_s + FINE.lags_s) == pytest.approx(0.2, abs=0.06)
    misled = estimated(run, profile=certain_of(COUNT - 1))
    assert tuple(int(ratios.argmax()) for ratios in misled.ratios) == run.symbols
    assert misled.plants[-1] < 0.5


def test_a_profile_makes_a_single_short_window_surer():
    profile = PlantProfile(estimated(fleet_run(31, message_ticks=300)).plants)
    known, plain = [], []
    for seed in range(41, 51):
        run = fleet_run(seed, message_ticks=50)
        for robot, symbol in enumerate(run.symbols):
            known.append(log_probability(alone(run, robot, profile), symbol))
            plain.append(log_probability(alone(run, robot, None), symbol))
    assert np.mean(known) > np.mean(plain) + 0.05


def alone(run, robot, profile):
    """Ratios of the first window of one robot, whose fellows were not filmed."""
    motions = motions_of(run)
    window = replace(windows_of(run, motions)[robot], observation=0)
    motion = motions[robot]
    return estimate([window], [motion], fit_recording_noise([motion], [motion.velocities]), profile).ratios[0]


def log_probability(ratios, symbol):
    return float(ratios[symbol] - np.logaddexp.reduce(ratios))


def faulty(edit):
    return edit(profile_text(PlantProfile(np.full(COUNT, 1.0 / COUNT))))


@pytest.mark.parametrize(
    ("edit", "sentence"),
    [
        (lambda text: text.replace("format = 3", "format = 1"), "profile format 1, this program reads 2 and 3"),
        (lambda text: text.replace("format = 3", ""), "profile format None"),
        (lambda text: text + "gain = 3\n", "unknown field 'gain'"),
        (lambda text: re.sub(r".*delay_s = 0.15, lag_s = 0.4.*\n", "", text), "does not list the 48 plants"),
        (lambda text: "format = 3\nplants = 3\n", "does not list the 48 plants"),
        (lambda text: text.replace("lag_s = 0.05", "lag_s = 0.07", 1), "plant 1 is none of this program's"),
        (
            lambda text: text.replace("lag_s", "lagging_s", 1),
            "must have delay_s, lag_s, return_s, notch_hz, weight",
        ),
        (lambda text: text.replace("weight = 0.0", "weight = -0.0", 1), "weight of plant 1 is -0.0"),
        (lambda text: text.replace("weight = 0.0", "weight = 0.9", 1), "the weights add up to 1.9"),
        (lambda text: text.replace(EVEN, "weight = nan", 1), "the weight of plant 1 is nan"),
        (
            lambda text: text.replace(EVEN, "weight = 'much'", 1),
            "plant 1 holds something that is not",
        ),
        (
            lambda text: text.replace(EVEN, "weight = true", 1),
            "plant 1 holds something that is not",
        ),
        (lambda text: text[:200], "is no profile"),
        (lambda text: "\x00", "is no profile"),
    ],
)
def test_a_faulty_file_is_refused_in_one_sentence(tmp_path, edit, sentence):
    path = tmp_path / "robot.profile"
    path.write_text(faulty(edit), encoding="utf-8")
    with pytest.raises(MtmError, match=re.escape(sentence)) as caught:
        load_profile(path)
    assert "\n" not in str(caught.value)


def test_a_file_of_the_former_format_knows_no_notches(tmp_path):
    weights = np.where(np.isinf(FINE.notches_hz), 1.0, 0.0)
    text = profile_text(PlantProfile(weights / weights.sum()))
    rows = [row for row in text.splitlines() if "notch_hz" not in row or "notch_hz = inf" in row]
    path = tmp_path / "robot.profile"
    path.write_text("\n".join(rows).replace("format = 3", "format = 2").replace(" notch_hz = inf,", ""))
    assert load_profile(path).weights == pytest.approx(weights / weights.sum())


def test_plants_with_a_notch_share_a_tenth_at_first():
    prior = np.exp(log_prior(None, FINE))
    assert prior.sum() == pytest.approx(1.0)
    assert prior[np.isfinite(FINE.notches_hz)].sum() == pytest.approx(0.1)


def test_a_file_that_is_not_there_is_refused_by_name(tmp_path):
    with pytest.raises(MtmError, match="cannot read the profile .*robot.profile: No such file"):
        load_profile(tmp_path / "robot.profile")
