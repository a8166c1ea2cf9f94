"""P as a forecast, and shares of time, against scikit-learn and statsmodels on fixed data."""

from __future__ import annotations

import math

import numpy as np
import pytest
import statsmodels.api as sm
from sklearn.calibration import calibration_curve
from sklearn.metrics import average_precision_score, brier_score_loss, roc_auc_score
from statsmodels.stats.nonparametric import rank_compare_2indep
from statsmodels.stats.proportion import proportion_confint

from foreshock.campaign.forecast import (
    auc_difference,
    brier,
    discrimination,
    precision_recall,
    reliability,
    roc,
)
from foreshock.campaign.times import Times, share_of_time

EXACT = 1e-9
"""Both compute the same sums; what differs is rounding."""
RNG = np.random.default_rng(11)
HAPPENED = [bool(v) for v in RNG.random(60) < 0.4]
# few distinct values, as P has, so that there are ties
P = [float(v) for v in np.clip(np.round(RNG.normal(0.4, 0.2, 60) + 0.25 * np.array(HAPPENED), 1), 0.0, 1.0)]
OTHER = [float(v) for v in np.round(RNG.random(60), 2)]


def test_brier_score_and_reliability_are_those_of_scikit_learn() -> None:
    found = brier(P, HAPPENED)
    assert found is not None
    assert found.score == pytest.approx(brier_score_loss(HAPPENED, P), rel=EXACT)
    errors = [(p - y) ** 2 for p, y in zip(P, HAPPENED, strict=True)]
    interval = sm.stats.DescrStatsW(errors).zconfint_mean(0.05)
    assert (found.low, found.high) == pytest.approx(interval, rel=EXACT)
    # off the edges of the bins, to which side a value there belongs is a convention
    inner = [p + 0.03 if p < 1.0 else 0.97 for p in P]
    bins = reliability(inner, HAPPENED)
    rates, means = calibration_curve(HAPPENED, inner, n_bins=10, strategy="uniform")
    assert [b.mean for b in bins] == pytest.approx(list(means), rel=EXACT)
    assert [b.rate.k / b.rate.n for b in bins] == pytest.approx(list(rates), rel=EXACT)
    assert sum(b.rate.n for b in bins) == 60
    for b in bins:
        assert (b.rate.low, b.rate.high) == pytest.approx(
            proportion_confint(b.rate.k, b.rate.n, 0.05, "wilson"), abs=EXACT
        )


def test_no_run_is_lost_at_the_ends_of_the_bins() -> None:
    bins = reliability([0.0, 1.0, 0.1, 0.999], [False, True, False, True])
    assert [(b.low, b.rate.n, b.rate.k) for b in bins] == [(0.0, 1, 0), (0.1, 1, 0), (0.9, 2, 2)]


def test_discrimination_is_that_of_scikit_learn_with_the_interval_of_statsmodels() -> None:
    """Brunner and Munzel's variance of P(X > Y) + P(X = Y) / 2 is that of DeLong."""
    found = discrimination(P, HAPPENED)
    assert found is not None
    assert found.auc == pytest.approx(roc_auc_score(HAPPENED, P), rel=EXACT)
    assert found.precision == pytest.approx(average_precision_score(HAPPENED, P), rel=EXACT)
    with_it = [p for p, y in zip(P, HAPPENED, strict=True) if y]
    without = [p for p, y in zip(P, HAPPENED, strict=True) if not y]
    assert (found.accidents, found.others) == (len(with_it), len(without))
    other = rank_compare_2indep(with_it, without, use_t=False)
    assert found.auc == pytest.approx(other.prob1, rel=EXACT)
    assert (found.low, found.high) == pytest.approx(other.conf_int(alpha=0.05), rel=1e-7)


def test_a_perfect_forecast_of_few_runs_is_not_certain() -> None:
    """Six disjoint pairs that are all in order: Wilson's interval of 6 of 6."""
    found = discrimination([0.1] * 9 + [0.9] * 6, [False] * 9 + [True] * 6)
    assert found is not None
    assert (found.auc, found.high) == (1.0, 1.0)
    assert found.low == pytest.approx(proportion_confint(6, 6, 0.05, "wilson")[0], abs=EXACT)
    worst = discrimination([0.9] * 9 + [0.1] * 6, [False] * 9 + [True] * 6)
    assert worst is not None
    assert (worst.low, worst.high) == pytest.approx(tuple(1.0 - v for v in (found.high, found.low)))
    assert discrimination([0.5, 0.6], [True, True]) is None


def test_the_difference_of_two_forecasts_of_the_same_runs() -> None:
    """Against a forecast that says nothing the difference is AUC - 1/2 with the AUC's own variance; against its
    mirror image 2 AUC - 1 with four times that.
    """
    alone = discrimination(P, HAPPENED)
    constant = auc_difference("constant", P, [0.5] * 60, HAPPENED)
    mirror = auc_difference("mirror", P, [-p for p in P], HAPPENED)
    assert alone is not None
    assert constant is not None
    assert mirror is not None
    assert constant.difference == pytest.approx(alone.auc - 0.5)
    assert constant.high - constant.low == pytest.approx(alone.high - alone.low)
    assert mirror.difference == pytest.approx(2.0 * alone.auc - 1.0)
    assert mirror.difference - mirror.low == pytest.approx(2.0 * (alone.auc - alone.low))
    assert auc_difference("itself", P, P, HAPPENED) is None


def test_the_difference_covers_what_it_estimates() -> None:
    """Paired forecasts with the same AUC: 95% of 400 intervals hold 0, not 4 sigma fewer."""
    rng = np.random.default_rng(5)
    truth = [True] * 60 + [False] * 60
    covered = 0
    for _ in range(400):
        shared = rng.normal(size=120) + np.array(truth)
        one, two = (shared + rng.normal(size=120) for _ in range(2))
        found = auc_difference("b", list(one), list(two), truth)
        assert found is not None
        covered += found.low <= 0.0 <= found.high
    assert covered / 400 > 0.95 - 4 * math.sqrt(0.95 * 0.05 / 400)


def test_curves_count_what_their_thresholds_let_through() -> None:
    positives, negatives = sum(HAPPENED), 60 - sum(HAPPENED)
    for x, y, t in roc(P, HAPPENED):
        above = [h for p, h in zip(P, HAPPENED, strict=True) if p >= t]
        assert (x, y) == pytest.approx(((len(above) - sum(above)) / negatives, sum(above) / positives))
    for recall, precision, t in precision_recall(P, HAPPENED)[:-1]:
        above = [h for p, h in zip(P, HAPPENED, strict=True) if p >= t]
        assert (recall, precision) == pytest.approx((sum(above) / positives, sum(above) / len(above)))


def test_share_of_time_is_the_weighted_regression_through_the_origin() -> None:
    """The ratio estimate and its variance are those of weighted least squares with the HC1 sandwich."""
    wholes = RNG.uniform(5.0, 20.0, 30)
    parts = wholes * RNG.uniform(0.1, 0.5, 30)
    found = share_of_time(list(parts), list(wholes))
    fit = sm.WLS(parts, wholes, weights=1.0 / wholes).fit(cov_type="HC1")
    assert found.share == pytest.approx(fit.params[0], rel=EXACT)
    assert (found.low, found.high) == pytest.approx(tuple(fit.conf_int(0.05)[0]), rel=EXACT)
    assert found.hours == pytest.approx(sum(wholes) / 3600.0)


def test_no_time_at_reduced_speed_in_few_runs_is_not_never() -> None:
    assert share_of_time([0.0] * 30, [10.0] * 30).high == pytest.approx(0.1)  # rule of three
    assert share_of_time([10.0] * 30, [10.0] * 30).low == pytest.approx(0.9)
    assert (share_of_time([3.0], [10.0]).low, share_of_time([3.0], [10.0]).high) == (0.0, 1.0)
    assert share_of_time([], []).n == 0


def test_quartiles_of_times_that_were_not_reached() -> None:
    times = Times((1.0, 2.0, 3.0, math.inf, math.inf))
    assert times.reached == 3
    assert times.quartiles_s == (2.0, 3.0, math.inf)
    assert list(times.quartiles_s) == [np.quantile(times.values_s, q, method="inverted_cdf") for q in (0.25, 0.5, 0.75)]
    assert Times(()).quartiles_s is None


def test_many_runs_need_no_table_of_all_pairs() -> None:
    """2 x 50,000 runs, whose pairs would take 20 GB; the area is that of scikit-learn."""
    rng = np.random.default_rng(2)
    truth = np.repeat([True, False], 50_000)
    p = np.round(rng.normal(size=100_000) + truth, 2)  # with ties
    found = discrimination(p.tolist(), truth.tolist())
    assert found is not None
    assert found.auc == pytest.approx(roc_auc_score(truth, p), abs=EXACT)
    assert found.low < found.auc < found.high
