"""What the feet can do: loaded soles, their support polygon, and the hull of both soles."""

from __future__ import annotations

from foreshock_detectors.balance._config import BalanceConfig
from foreshock_detectors.balance._kinematics import SolePose
from foreshock_detectors.balance._polygon import Point

__all__ = ["Load", "SoleRectangle"]


class SoleRectangle:
    """The sole's outline in its own frame."""

    def __init__(self, config: BalanceConfig) -> None:
        x0, x1, y = config.sole_x_min_m, config.sole_x_max_m, config.sole_y_half_m
        self._heel_m, self._toe_m, self._side_m = x0, x1, y

    def corners(self, sole: SolePose) -> list[Point]:
        """The four corners in the ground plane of odom (m), counterclockwise for a sole that stands on it."""
        (xx, xy, _), (yx, yy, _), _ = sole.rotation
        a, b, c = self._heel_m, self._toe_m, self._side_m
        hx, hy, tx, ty = sole.x + xx * a, sole.y + yx * a, sole.x + xx * b, sole.y + yx * b
        sx, sy = xy * c, yy * c
        return [(hx - sx, hy - sy), (tx - sx, ty - sy), (tx + sx, ty + sy), (hx + sx, hy + sy)]


class Load:
    """Whether a sole carries load, with hysteresis.

    Attributes:
        loaded: it carries load.
        force_n: vertical force of the newest sample (N).
    """

    __slots__ = ("_off_n", "_on_n", "force_n", "loaded")

    def __init__(self, config: BalanceConfig) -> None:
        self._on_n, self._off_n = config.contact_on_n, config.contact_off_n
        self.loaded = False
        self.force_n = 0.0

    def update(self, force_n: float) -> None:
        """Take the force (N) that presses the sole to the ground."""
        self.force_n = force_n
        self.loaded = force_n >= self._off_n if self.loaded else force_n > self._on_n
