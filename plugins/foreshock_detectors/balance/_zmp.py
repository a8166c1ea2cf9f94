"""The zero-moment point, from sole wrenches and from the centroidal momentum."""

from __future__ import annotations

from collections.abc import Iterable

from foreshock.messages import Vec3
from foreshock_detectors.balance._kinematics import SolePose

__all__ = ["zmp_from_momentum", "zmp_from_wrenches"]


def zmp_from_momentum(
    com: Vec3, momentum_rate: Vec3, angular_rate: Vec3, mass_kg: float, gravity_m_s2: float, ground_z_m: float
) -> tuple[float, float] | None:
    """(x, y) where the ground reaction that explains the motion pierces the ground without horizontal moment.

    The ground force is F = l' - m g, and its moment about the centre of mass is k' = (p - c) x F + (0, 0, tau_z), so

        p_x = c_x + ((z - c_z) F_x - k'_y) / F_z,    p_y = c_y + ((z - c_z) F_y + k'_x) / F_z

    It holds when nothing but the ground (and gravity) acts on the robot.

    Args:
        com: c (m).
        momentum_rate: l', rate of the linear momentum (N).
        angular_rate: k', rate of the angular momentum about the centre of mass (N m).
        mass_kg: m.
        gravity_m_s2: g.
        ground_z_m: z of the ground.

    Returns:
        None where the ground carries less than a tenth of the weight: the quotient then has no meaning.
    """
    fz = momentum_rate[2] + mass_kg * gravity_m_s2
    if fz < 0.1 * mass_kg * gravity_m_s2:
        return None
    drop = ground_z_m - com[2]
    return (
        com[0] + (drop * momentum_rate[0] - angular_rate[1]) / fz,
        com[1] + (drop * momentum_rate[1] + angular_rate[0]) / fz,
    )


def zmp_from_wrenches(
    contacts: Iterable[tuple[SolePose, Vec3, Vec3]], ground_z_m: float, least_force_n: float
) -> tuple[float, float] | None:
    """(x, y) of the centre of pressure of all soles together.

    With the force f and torque t that the ground exerts on a sole at position r with rotation R, and everything taken
    about the point below the origin on the ground: M = sum(r x R f + R t), p = (-M_y, M_x) / F_z.

    Args:
        contacts: pose of a sole with f (N) and t (N m) in its frame.
        ground_z_m: z of the ground.
        least_force_n: below this vertical force there is no support.

    Returns:
        None where nothing carries the robot.
    """
    fz = mx = my = 0.0
    for sole, (fx, fy, fn), (tx, ty, tz) in contacts:
        (xx, xy, xz), (yx, yy, yz), (zx, zy, zz) = sole.rotation
        wx = xx * fx + xy * fy + xz * fn
        wy = yx * fx + yy * fy + yz * fn
        wz = zx * fx + zy * fy + zz * fn
        rx, ry, rz = sole.x, sole.y, sole.z - ground_z_m
        fz += wz
        mx += ry * wz - rz * wy + xx * tx + xy * ty + xz * tz
        my += rz * wx - rx * wz + yx * tx + yy * ty + yz * tz
    if not fz > least_force_n:
        return None
    return -my / fz, mx / fz
