"""Sobol indices against closed forms and quadrature, through the code that the command runs."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import pytest

from foreshock.errors import ConfigError
from foreshock.risk import load_parameters
from foreshock.sensitivity import Indices, Study, sobol_indices
from foreshock.taxonomy import builtin_taxonomy

UNIT = {"x": (-1.0, 1.0), "y": (-1.0, 1.0), "z": (-1.0, 1.0)}
N = 1024
TOLERANCE = 0.05
"""Of an index at N = 1024: half of its 95% interval comes out at 0.02 to 0.05 in what is estimated here."""


def firsts(i: Indices) -> list[float]:
    return [x.first for x in i.factors]


def totals(i: Indices) -> list[float]:
    return [x.total for x in i.factors]


def test_the_ishigami_function() -> None:
    """f = sin x + 7 sin^2 y + 0.1 z^4 sin x on [-pi, pi]^3; closed form: Ishigami and Homma (1990)."""
    a, b, pi = 7.0, 0.1, math.pi
    v1 = 0.5 * (1.0 + b * pi**4 / 5.0) ** 2
    v2, v13 = a**2 / 8.0, b**2 * pi**8 * 8.0 / 225.0
    v = v1 + v2 + v13

    def f(x: Mapping[str, float]) -> dict[str, float]:
        return {"f": math.sin(x["x"]) * (1.0 + b * x["z"] ** 4) + a * math.sin(x["y"]) ** 2}

    (found,) = sobol_indices(f, dict.fromkeys("xyz", (-pi, pi)), N, 1, second_order=True)
    assert found.mean == pytest.approx(a / 2.0, abs=0.05)
    assert found.deviation == pytest.approx(math.sqrt(v), rel=0.03)
    assert firsts(found) == pytest.approx([v1 / v, v2 / v, 0.0], abs=TOLERANCE)
    assert totals(found) == pytest.approx([(v1 + v13) / v, v2 / v, v13 / v], abs=TOLERANCE)
    pairs = {i.factors: i.second for i in found.interactions}
    # second-order estimates are differences of three noisy ones
    assert [pairs[p] for p in (("x", "y"), ("x", "z"), ("y", "z"))] == pytest.approx([0, v13 / v, 0], abs=2 * TOLERANCE)


def test_a_polynomial_by_hand() -> None:
    """f = x + 2 y + 3 x y on [-1, 1]^3: var x = 1/3, var 2y = 4/3, var 3xy = 9 (1/3)^2 = 1; the sum is 8/3."""
    found = sobol_indices(lambda p: {"f": p["x"] + 2.0 * p["y"] + 3.0 * p["x"] * p["y"]}, UNIT, N, 0)[0]
    assert firsts(found) == pytest.approx([1 / 8, 4 / 8, 0.0], abs=TOLERANCE)
    assert totals(found) == pytest.approx([4 / 8, 7 / 8, 0.0], abs=TOLERANCE)
    assert found.factors[2].first == found.factors[2].total == 0.0


def test_a_step_by_hand() -> None:
    """A gate that opens if x > 0.5 and y > 0 (1/4, 1/2): V = pq(1 - pq), Vx = q^2 p(1 - p), Vy = p^2 q(1 - q)."""
    p, q = 0.25, 0.5
    v, vx, vy = p * q * (1 - p * q), q * q * p * (1 - p), p * p * q * (1 - q)
    found = sobol_indices(lambda at: {"f": float(at["x"] > 0.5 and at["y"] > 0.0)}, UNIT, 4 * N, 3)[0]
    # a step converges more slowly
    assert firsts(found) == pytest.approx([vx / v, vy / v, 0.0], abs=TOLERANCE)
    assert totals(found) == pytest.approx([1 - vy / v, 1 - vx / v, 0.0], abs=TOLERANCE)


def test_p_at_the_first_precursor_against_quadrature() -> None:
    """P = (1 - exp(-c)) / (1 + exp(-a (1 - b))): window, recurrence and gate have no part in it."""
    taxonomy = builtin_taxonomy()
    kinds = taxonomy.mode("A1").cascade
    study = Study(load_parameters("table-3", Path(), taxonomy), "independent", kinds, taxonomy)
    ranges = {f.id: (f.low, f.high) for f in study.factors}
    found = {i.output: i for i in sobol_indices(study.answers, ranges, 512, 2)}["p-first"]

    nodes, weights = np.polynomial.legendre.leggauss(40)

    def axis(name: str) -> np.ndarray:
        low, high = ranges[name]
        return 0.5 * (high - low) * nodes + 0.5 * (high + low)

    w = weights / 2.0
    a, b, c = np.meshgrid(axis("a"), axis("b"), axis("c"), indexing="ij")
    p = (1.0 - np.exp(-c)) / (1.0 + np.exp(-a * (1.0 - b)))
    w3 = w[:, None, None] * w[None, :, None] * w[None, None, :]
    mean = (w3 * p).sum()
    v = (w3 * p**2).sum() - mean**2
    expected_first, expected_total = [], []
    for k in range(3):
        others = tuple(j for j in range(3) if j != k)
        given_k = (p * (w3 / w.reshape([-1 if j == k else 1 for j in range(3)]))).sum(axis=others)
        expected_first.append(((w * given_k**2).sum() - mean**2) / v)
        without = (p * w.reshape([-1 if j == k else 1 for j in range(3)])).sum(axis=k)
        expected_total.append(1.0 - ((np.outer(w, w) * without**2).sum() - mean**2) / v)
    # quasi-random: the mean is far better than the 0.13 / sqrt(512) = 0.006 of random points
    assert found.mean == pytest.approx(mean, abs=0.003)
    assert found.deviation == pytest.approx(math.sqrt(v), rel=0.03)
    for i, first, total in zip(found.factors, expected_first, expected_total, strict=False):
        # three standard errors of six indices, against intervals of 1.96
        assert abs(i.first - first) <= 1.5 * i.first_half
        assert abs(i.total - total) <= 1.5 * i.total_half
        assert max(i.first_half, i.total_half) < 0.12
    assert firsts(found)[3:] == totals(found)[3:] == [0.0, 0.0, 0.0]


def linear(p: Mapping[str, float]) -> dict[str, float]:
    return {"f": p["x"] + 2.0 * p["y"] + 3.0 * p["x"] * p["y"]}


@pytest.mark.parametrize("seed", [0, 7])
def test_a_seed_gives_the_same_again_intervals_included(seed: int) -> None:
    assert sobol_indices(linear, UNIT, 64, seed) == sobol_indices(linear, UNIT, 64, seed)
    assert sobol_indices(linear, UNIT, 64, seed) != sobol_indices(linear, UNIT, 64, seed + 1)


def test_convergence_is_from_the_run_with_half_of_the_samples() -> None:
    whole, half = (sobol_indices(linear, UNIT, n, 5)[0] for n in (512, 256))
    assert [i.total_before for i in whole.factors] == pytest.approx(totals(half), abs=1e-12)
    assert [i.first_before for i in whole.factors] == pytest.approx(firsts(half), abs=1e-12)
    moved = [abs(a - b) for a, b in zip(firsts(whole) + totals(whole), firsts(half) + totals(half), strict=True)]
    assert whole.moved == pytest.approx(max(moved), abs=1e-12)


def test_intervals_hold_the_truth_and_shrink() -> None:
    truth = [4 / 8, 7 / 8, 0.0]
    narrow, wide = (sobol_indices(linear, UNIT, n, 11)[0] for n in (2048, 128))
    for found in (narrow, wide):
        # three standard errors, not two: six intervals, of 95% each
        assert all(abs(i.total - t) <= 1.5 * i.total_half + 1e-9 for i, t in zip(found.factors, truth, strict=True))
    assert narrow.factors[1].total_half < 0.5 * wide.factors[1].total_half


def test_an_output_that_never_varies_has_no_indices() -> None:
    varies, constant = sobol_indices(lambda p: {"f": p["x"], "g": 0.1 + 0.2}, UNIT, 16, 0)
    assert len(varies.factors) == 3
    assert (constant.factors, constant.deviation, constant.moved) == ((), 0.0, 0.0)
    assert constant.mean == pytest.approx(0.3)


def test_one_that_varies_in_the_second_half_only_has_indices() -> None:
    calls = iter(range(10**6))

    def late(p: Mapping[str, float]) -> dict[str, float]:
        return {"f": p["x"] if next(calls) >= 5 * 8 else 0.0}

    (found,) = sobol_indices(late, UNIT, 16, 0)
    assert len(found.factors) == 3
    assert [i.total_before for i in found.factors] == [0.0, 0.0, 0.0]


@pytest.mark.parametrize(("samples", "near"), [(100, 64), (8, 16), (0, 16)])
def test_samples_are_a_power_of_two(samples: int, near: int) -> None:
    with pytest.raises(ConfigError, match=f"take {near}"):
        sobol_indices(linear, UNIT, samples, 0)


def test_every_evaluation_is_told() -> None:
    told: list[None] = []
    sobol_indices(linear, UNIT, 16, 0, lambda: told.append(None))
    assert len(told) == 16 * (3 + 2)
