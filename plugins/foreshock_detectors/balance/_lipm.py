"""The linear inverted pendulum: capture point and predicted time until the centre of mass has left the feet.

With the centre of mass c at constant height z above the soles and the centre of pressure p (Kajita 2001):

    c'' = w0^2 (c - p),   w0 = sqrt(g / z)

The capture point xi = c + c' / w0 (Pratt 2006; extrapolated centre of mass, Hof 2005) obeys xi' = w0 (xi - p). With
constant p both have closed forms, which the functions below solve for a time.
"""

from __future__ import annotations

import math

from foreshock_detectors.balance._polygon import Polygon, nearest_boundary_point, signed_margin

__all__ = ["capture_time_s", "crossing_time_s", "natural_frequency", "time_to_fall_s"]


def natural_frequency(height_m: float, gravity_m_s2: float) -> float:
    """w0 in rad/s. Raises ValueError where the centre of mass is not above the soles."""
    if not height_m > 0.0:
        raise ValueError(f"the centre of mass lies {height_m:.3f} m above the soles; expected a positive height")
    return math.sqrt(gravity_m_s2 / height_m)


def capture_time_s(capture_m: float, cop_m: float, edge_m: float, w0: float) -> float:
    """Time (s) until the capture point reaches an edge: (1 / w0) ln((e - p) / (xi0 - p)).

    All on one axis, with constant centre of pressure p. 0 if it is there already, inf if it moves away or rests.
    """
    run, start = edge_m - cop_m, capture_m - cop_m
    if run < 0.0:
        run, start = -run, -start
    if start >= run:
        return 0.0
    return math.log(run / start) / w0 if start > 0.0 else math.inf


def crossing_time_s(com_m: float, velocity_m_s: float, edge_m: float, w0: float) -> float:
    """Time (s) until the centre of mass passes an edge in positive direction, with the centre of pressure at that edge.

    c(t) - p = A exp(w0 t) + B exp(-w0 t) with A = (xi0 - p) / 2, B = (c0 - c0' / w0 - p) / 2 and p = e. The zero is at
    t = ln(-B / A) / (2 w0). 0 if the centre of mass is past the edge, inf if it never gets there (A <= 0).
    """
    if com_m >= edge_m:
        return 0.0
    a = com_m + velocity_m_s / w0 - edge_m
    b = com_m - velocity_m_s / w0 - edge_m
    # com < edge means a + b < 0, so that -b > a: the logarithm is positive whenever a is
    return math.log(-b / a) / (2.0 * w0) if a > 0.0 else math.inf


def time_to_fall_s(
    hull: Polygon,
    com: tuple[float, float],
    velocity: tuple[float, float],
    w0: float,
    tolerance_m: float,
    horizon_s: float,
) -> float | None:
    """Time (s) until the centre of mass leaves the hull of both soles, or None where no fall is predicted.

    While the capture point lies in the hull, some centre of pressure (now, or once the swing foot is down) stops the
    robot on its feet. Outside by a distance d > tolerance_m none does: along the outward normal n of the nearest
    boundary point e, n . (xi - p) >= d for every p in the hull, so that d' >= w0 d. The best that the feet can do is to
    keep the centre of pressure at e; with it the centre of mass passes e after crossing_time_s, and from there gravity
    only accelerates the fall. Torso, arms and a step beyond the present feet could still help: the prediction is for
    feet that stay where they are, hence later than or equal to the fall of a robot that does less.

    Args:
        hull: of both soles, on the ground (m).
        com: centre of mass (m).
        velocity: its velocity (m/s).
        w0: natural frequency (rad/s).
        tolerance_m: how far outside the capture point must be.
        horizon_s: a later fall is None.
    """
    x, y = com[0] + velocity[0] / w0, com[1] + velocity[1] / w0
    distance = -signed_margin(hull, x, y)
    if not distance > tolerance_m:
        return None
    ex, ey = nearest_boundary_point(hull, x, y)
    nx, ny = x - ex, y - ey
    nx, ny = nx / distance, ny / distance
    time_s = crossing_time_s(nx * com[0] + ny * com[1], nx * velocity[0] + ny * velocity[1], nx * ex + ny * ey, w0)
    return time_s if time_s <= horizon_s else None
