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


def crossing_time_s(com_m: float, velocity_m_s: float, cop_m: float, edge_m: float, w0: float) -> float:
    """Time (s) until the centre of mass passes an edge e in positive direction, at constant centre of pressure p <= e.

    c(t) - p = A u + B / u with u = exp(w0 t), A = (xi0 - p) / 2, B = (c0 - c0' / w0 - p) / 2. With r = e - p it passes
    the edge at the larger root of A u^2 - r u + B = 0. 0 if it is past the edge, inf if it never gets there (A <= 0).
    """
    if com_m >= edge_m:
        return 0.0
    a = 0.5 * (com_m + velocity_m_s / w0 - cop_m)
    b = 0.5 * (com_m - velocity_m_s / w0 - cop_m)
    r = edge_m - cop_m
    if a <= 0.0:
        return math.inf
    # com < edge means a + b < r, so that 4 a b < r^2; rounding may still reach zero from below. A root below 1 lies in
    # the past: the centre of mass turned round before the edge.
    u = (r + math.sqrt(max(0.0, r * r - 4.0 * a * b))) / (2.0 * a)
    return math.log(u) / w0 if u > 1.0 else math.inf


def time_to_fall_s(
    hull: Polygon,
    support: Polygon,
    com: tuple[float, float],
    velocity: tuple[float, float],
    w0: float,
    tolerance_m: float,
    horizon_s: float,
) -> float | None:
    """Time (s) until the centre of mass leaves the hull of both soles, or None where no fall is predicted.

    While the capture point lies in the hull, some centre of pressure (now, or once the swing foot is down) stops the
    robot on its feet. Outside by a distance d > tolerance_m none does: along the outward normal n of the nearest
    boundary point e, n . (xi - p) >= d for every p in the hull, so that d' >= w0 d. The time is that until the centre
    of mass passes e along n, with the centre of pressure as far out along n as the present support allows; from there
    gravity only accelerates the fall. A swing foot that lands in time delays it; torso, arms and a step beyond the
    present feet may prevent it.

    Args:
        hull: of both soles, on the ground (m).
        support: of the soles that carry load; the hull itself where that is not known.
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
    nx, ny = (x - ex) / distance, (y - ey) / distance
    edge = nx * ex + ny * ey
    cop = min(edge, max(nx * a + ny * b for a, b in support))
    time_s = crossing_time_s(nx * com[0] + ny * com[1], nx * velocity[0] + ny * velocity[1], cop, edge, w0)
    return time_s if time_s <= horizon_s else None
