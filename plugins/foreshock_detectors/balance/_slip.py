"""Foot micro-slip: how far a loaded sole has moved on the ground since it was set down.

Position and velocity of the sole in odom are both noisy; neither alone finds 2 mm quickly. Per horizontal axis a Kalman
filter with the states s (displacement) and r (place where the sole was set down) fuses them:

    s(k+1) = (1 - l) s(k) + v(k) dt,   r(k+1) = r(k) + l s(k),   position(k) = r(k) + s(k) + noise,   l = dt / T_forget

At the first settled sample s = 0 is certain and r is as uncertain as one position. Both axes share one covariance. The
leak l lets drift of the odometry and slips that have ended pass from s to r.
"""

from __future__ import annotations

import math

from foreshock.clock import NS_PER_S
from foreshock_detectors.balance._config import BalanceConfig
from foreshock_detectors.balance._kinematics import SolePose
from foreshock_detectors.balance._signals import Hysteresis

__all__ = ["FootSlip"]


class FootSlip:
    """The sequential test for one foot.

    Attributes:
        slip_m: estimated horizontal displacement since the sole was set down, less what has leaked away.
        sd_m: standard deviation of that estimate on one axis.
        observed: False at first and after a jump or gap, until the sole is settled anew: what it did is unknown.
        threshold_m: slip_m of the configuration, or slip_sigmas times sd_m where that is more.
    """

    def __init__(self, config: BalanceConfig) -> None:
        self._config = config
        self._settle_ns = round(config.slip_settle_s * NS_PER_S)
        self._hysteresis = Hysteresis(config.release_ratio)
        self._sx = self._sy = self._rx = self._ry = 0.0
        self._ss = self._sr = self._rr = 0.0
        self._stamp_ns = 0
        self._loaded_ns = self._outlier_ns = -1
        self._anchored = self.observed = False
        self.slip_m = self.sd_m = 0.0
        self.threshold_m = config.slip_m

    @property
    def present(self) -> bool:
        """The verdict."""
        return self._hysteresis.present

    def lose(self) -> None:
        """The stream was interrupted or jumped: nothing is known until the sole is settled anew."""
        self._clear(observed=False)

    def update(self, stamp_ns: int, sole: SolePose, *, loaded: bool) -> None:
        """Judge the sole at stamp_ns, later than the update before. It is settled once loaded for slip_settle_s."""
        if not loaded:
            self._clear(observed=True)
        elif self._anchored:
            self._track(stamp_ns, (stamp_ns - self._stamp_ns) / NS_PER_S, sole)
        elif self._loaded_ns < 0:
            self._loaded_ns = stamp_ns
        elif stamp_ns - self._loaded_ns >= self._settle_ns:
            self._anchored = self.observed = True
            self._rx, self._ry = sole.x, sole.y
            self._sx = self._sy = self._ss = self._sr = 0.0
            self._rr = self._config.sole_position_sd_m**2
        self._stamp_ns = stamp_ns
        if self.observed:
            self._hysteresis.judge(self.slip_m, self.threshold_m)

    def _clear(self, *, observed: bool) -> None:
        self.observed = observed
        self._anchored = False
        self._loaded_ns = self._outlier_ns = -1
        self.slip_m = self.sd_m = 0.0
        self.threshold_m = self._config.slip_m

    def _track(self, stamp_ns: int, dt: float, sole: SolePose) -> None:
        leak = min(1.0, dt / self._config.slip_forget_s)
        keep = 1.0 - leak
        sx, sy, rx, ry = self._sx, self._sy, self._rx, self._ry
        rx, ry = rx + leak * sx, ry + leak * sy
        sx, sy = keep * sx + sole.vx * dt, keep * sy + sole.vy * dt
        ss, sr, rr = self._ss, self._sr, self._rr
        rr += leak * (leak * ss + 2.0 * sr)
        sr = keep * (leak * ss + sr)
        ss = keep * keep * ss + (self._config.sole_velocity_sd_m_s * dt) ** 2
        ex, ey = sole.x - rx - sx, sole.y - ry - sy
        if math.hypot(ex, ey) > self._config.jump_m:
            if self._jumped(stamp_ns):
                return
        else:
            self._outlier_ns = -1
            s, r = ss + sr, sr + rr
            total = s + r + self._config.sole_position_sd_m**2
            ks, kr = s / total, r / total
            sx, sy, rx, ry = sx + ks * ex, sy + ks * ey, rx + kr * ex, ry + kr * ey
            ss, sr, rr = ss - ks * s, sr - ks * r, rr - kr * r
        self._sx, self._sy, self._rx, self._ry = sx, sy, rx, ry
        self._ss, self._sr, self._rr = ss, sr, rr
        self.slip_m, self.sd_m = math.hypot(sx, sy), math.sqrt(ss)
        self.threshold_m = max(self._config.slip_m, self._config.slip_sigmas * self.sd_m)

    def _jumped(self, stamp_ns: int) -> bool:
        """One outlier is coasted over on velocity; positions that stay away for the settling time are a jump."""
        if self._outlier_ns < 0:
            self._outlier_ns = stamp_ns
        if stamp_ns - self._outlier_ns < self._settle_ns:
            return False
        self.lose()
        return True
