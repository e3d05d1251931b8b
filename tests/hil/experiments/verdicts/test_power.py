from hil.experiments.verdicts.power import (
    CONDITIONS,
    decode_job,
    power_cells,
    slower_parameters,
    smallest_decoded,
    summarise_power,
)
from hil.plants.mecanum import calibrated_parameters

ONCE = CONDITIONS[0]


def result(verdict, right=True):
    at = {f"verdict {threshold}": verdict for threshold in ("0.1", "0.01", "0.0001")}
    return {**at, **{f"right {threshold}": right for threshold in ("0.1", "0.01", "0.0001")}, "likeliest_right": right}


def test_a_rollout_of_the_paper_s_job_is_decoded():
    found = decode_job({"condition": ONCE.name, "ticks": 300}, 1)
    assert (found["verdict 0.1"], found["right 0.1"], found["likeliest_right"]) == ("decoded", True, True)
    assert found == decode_job({"condition": ONCE.name, "ticks": 300}, 1)


def test_conditions_share_their_seeds():
    assert [cell.seed for cell in power_cells(ONCE, 100, 2, 7)] == [7, 8]
    assert [cell.seed for cell in power_cells(CONDITIONS[1], 100, 2, 7)] == [7, 8]


def test_rollouts_are_counted_by_verdict():
    results = [result("decoded"), result("decoded", right=False), result("absent"), result("inconclusive")]
    summary = summarise_power(ONCE, 100, results)[2]
    assert (summary.decoded, summary.wrong, summary.absent, summary.inconclusive) == (2, 1, 1, 1)
    assert (summary.likeliest, summary.likeliest_absent) == (3, 1)


def test_from_the_smallest_message_on_most_are_decoded():
    by_ticks = {100: "decoded", 150: "absent", 200: "decoded", 300: "decoded"}
    summaries = [item for ticks, name in by_ticks.items() for item in summarise_power(ONCE, ticks, [result(name)])]
    assert smallest_decoded(summaries, ONCE.name, 1e-4) == 200
    assert smallest_decoded(summaries[:6], ONCE.name, 1e-4) is None


def test_the_slower_chassis_lags_behind_the_calibrated_one():
    assert slower_parameters().lag_s == 2.0 * calibrated_parameters().lag_s
