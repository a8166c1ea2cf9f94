"""The slip test alone, on generated sole positions and velocities with the noise that it is configured for."""

from __future__ import annotations

import math

import numpy as np
import pytest

from foreshock_detectors.balance import BalanceConfig
from foreshock_detectors.balance._kinematics import SolePose
from foreshock_detectors.balance._slip import FootSlip
from foreshock_detectors.balance._support import Load

CONFIG = BalanceConfig()
FLAT = np.eye(3).tolist()


class Ground:
    """A sole at (x, y)(t) seen through white noise, at a fixed or jittering period."""

    def __init__(self, seed=0, rate_hz=200.0, position_sd_m=None, velocity_sd_m_s=None, config=CONFIG):
        self.rng = np.random.default_rng(seed)
        self.dt = 1.0 / rate_hz
        self.position_sd_m = CONFIG.sole_position_sd_m if position_sd_m is None else position_sd_m
        self.velocity_sd_m_s = CONFIG.sole_velocity_sd_m_s if velocity_sd_m_s is None else velocity_sd_m_s
        self.slip = FootSlip(config)
        self.k = 0

    @property
    def t(self):
        return self.k * self.dt

    def step(self, x=0.0, y=0.0, vx=0.0, vy=0.0, loaded=True):
        e = self.rng.standard_normal(4)
        sole = SolePose(
            0.3 + x + e[0] * self.position_sd_m,
            -0.1 + y + e[1] * self.position_sd_m,
            0.0,
            vx + e[2] * self.velocity_sd_m_s,
            vy + e[3] * self.velocity_sd_m_s,
            FLAT,
        )
        self.k += 1
        self.slip.update(round(self.t * 1e9), sole, loaded=loaded)
        return self.slip


def test_estimated_standard_deviation_is_the_sampled_one():
    """The filter's covariance against 400 runs: sd of a sample sd is 1 / sqrt(2 * 800), so 15 % is over 5 sigmas."""
    errors, claimed = [], []
    for seed in range(400):
        ground = Ground(seed)
        for _ in range(80):
            ground.step()
        errors += [ground.slip._sx, ground.slip._sy]
        claimed.append(ground.slip.sd_m)
    assert np.std(errors) == pytest.approx(np.mean(claimed), rel=0.15)


@pytest.mark.parametrize("rate_hz", [100.0, 200.0, 1000.0])
def test_stepping_in_place_raises_no_alarm(rate_hz):
    """About 120 steps: set down 0.75 s, lifted 0.45 s, moved by 30 mm while in the air."""
    ground, rng = Ground(1, rate_hz), np.random.default_rng(2)
    for _ in range(120):
        place = rng.normal(0.0, 0.03, 2)
        while ground.t % 1.2 < 0.75 - 1e-9:
            assert not ground.step(*place).present
        while ground.t % 1.2 > 1e-9 and ground.t % 1.2 < 1.2 - 1e-9:
            assert not ground.step(*place, 0.1, 0.0, loaded=False).present
            assert ground.slip.slip_m == 0.0


@pytest.mark.parametrize("rate_hz", [100.0, 200.0, 1000.0])
@pytest.mark.parametrize("speed_m_s", [0.02, 0.1, 0.5])
def test_a_slip_is_found_soon_after_two_millimetres(rate_hz, speed_m_s):
    """Delay after the true displacement is 2 mm: half of the noise in position over speed, at least two samples."""
    for seed in range(20):
        ground = Ground(seed, rate_hz)
        while ground.t < 0.2:
            assert not ground.step().present
        moved = 0.0
        while not ground.slip.present:
            moved += speed_m_s * ground.dt
            assert moved < 0.02 + 3 * speed_m_s * ground.dt
            ground.step(0.6 * moved, -0.8 * moved, 0.6 * speed_m_s, -0.8 * speed_m_s)
        # never far before: five standard deviations below the threshold
        assert moved > CONFIG.slip_m - 5 * ground.slip.sd_m
        assert moved < CONFIG.slip_m + 5 * ground.slip.sd_m + 2 * speed_m_s * ground.dt


def test_slip_is_seen_in_position_alone():
    """A velocity that does not know of the slip delays the answer but does not hide it."""
    ground = Ground(3)
    while ground.t < 0.3:
        ground.step()
    for k in range(100):
        ground.step(y=min(0.006, 0.0005 * k))
    assert ground.slip.present


def test_drift_of_odometry_is_no_slip_and_an_ended_slip_is_cleared():
    ground = Ground(4)
    while ground.t < 30.0:  # 0.5 mm/s: 15 mm in all
        assert not ground.step(x=0.0005 * ground.t, vx=0.0005).present
    start = 0.015
    for k in range(20):
        ground.step(x=start + 0.0005 * k, vx=0.1)
    assert ground.slip.present
    end = ground.t
    while ground.slip.present:
        ground.step(x=start + 0.0095)
    # 9.5 mm fall to 0.7 * 2 mm after T ln(9.5 / 1.4) = 1.9 T without what the filter learns from positions
    assert ground.t - end == pytest.approx(CONFIG.slip_forget_s * math.log(9.5 / 1.4), rel=0.2)


def test_a_single_outlier_is_no_slip_and_a_jump_is_unobserved_until_settled():
    ground = Ground(5)
    while ground.t < 0.5:
        ground.step()
    assert not ground.step(x=0.5).present
    assert ground.slip.observed
    for _ in range(20):
        assert not ground.step().present
    states = []
    for _ in range(40):
        ground.step(x=0.5)
        states.append(ground.slip.observed)
        assert not ground.slip.present
    # coasting 50 ms, then unobserved while settling for 50 ms, then observed at the new place
    assert states[:9] == [True] * 9
    assert 10 <= states.count(False) <= 12
    assert states[-1]


def test_nothing_is_observed_before_the_sole_has_settled_or_is_seen_unloaded():
    ground = Ground(6)
    assert [ground.step().observed for _ in range(12)] == [False] * 10 + [True] * 2
    assert Ground(6).step(loaded=False).observed
    ground.slip.lose()
    assert not ground.step().observed


def test_noisier_sensors_raise_the_threshold_instead_of_the_alarm_rate():
    config = BalanceConfig(sole_position_sd_m=0.005, sole_velocity_sd_m_s=0.05)
    ground = Ground(7, position_sd_m=0.005, velocity_sd_m_s=0.05, config=config)
    while ground.t < 20.0:
        assert not ground.step().present
    assert ground.slip.threshold_m > 2 * CONFIG.slip_m


def test_load_has_hysteresis():
    load = Load(CONFIG)
    seen = []
    for force in (0.0, 80.0, 101.0, 80.0, 61.0, 59.0, 80.0, 101.0):
        load.update(force)
        seen.append(load.loaded)
    assert seen == [False, False, True, True, True, False, False, True]
