"""The walk as the robot plans it: footholds, centre of pressure, and the motion of the centre of mass that follows.

Linear inverted pendulum with natural frequency w = sqrt(g / z), divergent component of motion (capture point) xi:

    c' = w (xi - c)            xi' = w (xi - p)

On a segment whose centre of pressure goes from p0 to p1 = p0 + s T, with r = T - t left,

    xi(t) = p(t) + s / w + exp(-w r) (xi(T) - p1 - s / w)

so that xi is known by recursion from the end of the plan, where the robot stands and xi = p (Englsberger et al., IROS
2011). The plan always ends in a stand a few steps ahead and is made anew at every touch-down, for as long as the robot
walks; what is changed four steps ahead moves xi now by exp(-w 3.6 s), less than a micrometre.

All in the plan's frame, axes of the ground; the controller knows where that frame lies.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import msgspec

__all__ = ["Foothold", "Gait", "GaitSettings", "Wanted"]

_HORIZON = 4
_ALIGNED_M = 0.005
_STAND_S = 1e9
_CLOSE_S = 0.5


class Foothold(NamedTuple):
    """Place (m) and heading (rad) of a sole on the ground."""

    x: float
    y: float
    yaw: float


class GaitSettings(msgspec.Struct, frozen=True):
    """Times (s) and sizes (m) of a step.

    Attributes:
        single_s: single support.
        double_s: double support.
        lift_m: how high the swing foot is lifted.
        com_z_m: height of the centre of mass.
        sole_x_m: middle of the sole, forward of its frame.
        inset_m: the centre of pressure is planned so far inwards of the middle of a sole.
        reach_m: half length and half width of a sole that the plan may use while it settles.
        settle_gain: of the centre of pressure on the capture point while it settles.
    """

    single_s: float
    double_s: float
    lift_m: float
    com_z_m: float
    sole_x_m: float
    inset_m: float
    reach_m: tuple[float, float]
    settle_gain: float = 1.5


class Wanted(msgspec.Struct, frozen=True):
    """What the next steps are to be.

    Attributes:
        walk: whether there are to be any.
        length_m: from foot to foot.
        lift: share of the lift.
        turn_rad: change of heading per step.
        aside_m: shift to the left per step.
    """

    walk: bool
    length_m: float = 0.0
    lift: float = 1.0
    turn_rad: float = 0.0
    aside_m: float = 0.0


class _Segment(NamedTuple):
    duration_s: float
    p0: tuple[float, float]
    p1: tuple[float, float]
    swing: int  # foot in the air: 0 left, 1 right, -1 none
    target: Foothold | None
    lift_m: float


class Gait:
    """Plans and runs the walk. Feet are numbered 0 left, 1 right.

    Attributes:
        com: planned place of the centre of mass (m).
        xi: planned capture point (m).
        feet: planned footholds; of a swing foot the one that it left.
        swing: foot in the air, or -1.
        settling: the steps have been suppressed.
        steps: touch-downs so far.
        lifted: the swing foot has just left the ground; true for one advance.

    Args:
        settings: times and sizes.
        feet: where the feet stand at first.
        com: where the centre of mass is at first.
        first: foot that swings first.
    """

    def __init__(
        self, settings: GaitSettings, feet: tuple[Foothold, Foothold], com: tuple[float, float], first: int
    ) -> None:
        self._s = settings
        self.omega = math.sqrt(9.81 / settings.com_z_m)
        self._width_m = feet[0].y - feet[1].y
        self.feet = list(feet)
        self.com, self._rate = com, (0.0, 0.0)
        self._next_swing = first
        self.swing, self.settling, self.lifted, self.steps = -1, False, False, 0
        self._from = feet[0]
        self._plan: list[_Segment] = []
        self._ends: list[tuple[float, float]] = []
        self._t = 0.0
        self._goal = com
        self._landing_s = self._landing_t = 0.0
        self._landing: tuple[float, float, float, Foothold, Foothold] = (0.0, 0.0, 0.0, feet[0], feet[0])
        self._stand()
        self.xi = self._xi()

    # --- running -------------------------------------------------------------------------------------------------

    def advance(self, dt: float, wanted: Wanted) -> None:
        """Go on by dt (s)."""
        self.lifted = False
        if self.settling:
            self._settle(dt)
            return
        self._t += dt
        segment = self._plan[0]
        if segment.duration_s == _STAND_S:
            if wanted.walk:
                self._walk(wanted)
        elif self._t >= segment.duration_s - 1e-9:
            self._next(wanted)
        self.xi = xi = self._xi()
        k = 1.0 - math.exp(-self.omega * dt)
        cx, cy = self.com
        new = (cx + k * (xi[0] - cx), cy + k * (xi[1] - cy))
        self._rate = ((new[0] - cx) / dt, (new[1] - cy) / dt)
        self.com = new

    @property
    def standing(self) -> bool:
        """On both feet, with no step planned."""
        return self.settling or self._plan[0].duration_s == _STAND_S

    @property
    def support(self) -> tuple[int, ...]:
        """Feet that the plan loads."""
        return (0, 1) if self.swing < 0 else (1 - self.swing,)

    @property
    def shares(self) -> tuple[float, float]:
        """Shares of the weight that the left and the right foot carry by the plan."""
        if self.swing >= 0:
            return (0.0, 1.0) if self.swing == 0 else (1.0, 0.0)
        if self.settling:
            p = self.com
        else:
            segment = self._plan[0]
            u = min(1.0, self._t / segment.duration_s)
            p = tuple(a + u * (b - a) for a, b in zip(segment.p0, segment.p1, strict=True))  # type: ignore[assignment]  # two
        (ax, ay), (bx, by) = self._middle(0), self._middle(1)
        dx, dy = bx - ax, by - ay
        right = ((p[0] - ax) * dx + (p[1] - ay) * dy) / (dx * dx + dy * dy)
        right = min(1.0, max(0.0, right))
        return 1.0 - right, right

    @property
    def landing(self) -> tuple[float, Foothold]:
        """Share of the swing that is over, and where the foot goes; 0 and a standing foot if none swings."""
        if self.swing < 0:
            return 0.0, self.feet[0]
        if self.settling:
            return min(1.0, self._landing_t / self._landing_s), self._landing[4]
        return min(1.0, self._t / self._plan[0].duration_s), self._plan[0].target or self._from

    def foot(self, which: int) -> tuple[Foothold, float, tuple[float, float, float]]:
        """Planned place of a sole, its height above the ground (m) and its velocity (m/s)."""
        if which != self.swing:
            return self.feet[which], 0.0, (0.0, 0.0, 0.0)
        if self.settling:
            return self._landing_foot()
        segment = self._plan[0]
        target = segment.target or self._from
        u = min(1.0, self._t / segment.duration_s)
        b = u * (1.0 - u)
        share, rate = u**3 * (10.0 - 15.0 * u + 6.0 * u * u), 30.0 * b * b / segment.duration_s
        lift, lift_rate = 64.0 * b**3, 192.0 * b * b * (1.0 - 2.0 * u) / segment.duration_s
        a = self._from
        place = Foothold(*(p + share * (q - p) for p, q in zip(a, target, strict=True)))
        velocity = (rate * (target.x - a.x), rate * (target.y - a.y), lift_rate * segment.lift_m)
        return place, lift * segment.lift_m, velocity

    def path(self, horizon_s: float, points: int) -> list[tuple[float, float, float]]:
        """Planned (time from now, x, y) of the middle between the soles, over a horizon."""
        times, xs, ys = [0.0], [], []
        left, right = self.foot(0)[0], self.foot(1)[0]
        xs.append(0.5 * (left.x + right.x))
        ys.append(0.5 * (left.y + right.y))
        if not self.settling:
            feet, t = [left, right], -self._t
            for segment in self._plan:
                t += segment.duration_s
                if segment.swing < 0 or segment.target is None:
                    continue
                feet[segment.swing] = segment.target
                times.append(t)
                xs.append(0.5 * (feet[0].x + feet[1].x))
                ys.append(0.5 * (feet[0].y + feet[1].y))
        return [
            (at, _between(at, times, xs), _between(at, times, ys))
            for at in (horizon_s * k / (points - 1) for k in range(points))
        ]

    # --- suppression of steps --------------------------------------------------------------------------------------

    def suppress(self, strength: float, landing_s: float, com: tuple[float, float], rate: tuple[float, float]) -> None:
        """Put the swing foot down and bring the centre of mass over the middle of both feet, from its measured state.

        The landing takes landing_s at strength 1, and as long as the step still has at strength 0; likewise the foot
        comes down where it is, or where it was going.
        """
        if self.settling:
            return
        if self.swing >= 0:
            place, height, velocity = self.foot(self.swing)
            left_s = self._plan[0].duration_s - self._t
            target = self._plan[0].target or place
            self._landing_s = max(0.02, (1.0 - strength) * left_s + strength * min(landing_s, left_s))
            goes = Foothold(*(a + (1.0 - strength) * (b - a) for a, b in zip(place, target, strict=True)))
            self._landing = (height, velocity[2], 0.0, place, goes)
            self._landing_t = 0.0
        # who stands has nothing to put down: the plan stays where it is, and feedback brings the robot back to it
        self.com, self._rate = (self.com, (0.0, 0.0)) if self.standing else (com, rate)
        self.settling = True

    def resume(self) -> None:
        """Stand where the feet are; steps may begin again."""
        if self.settling and self.swing < 0:
            self.settling = False
            self._stand()

    def settled(self) -> bool:
        """Whether the capture point has come to rest where it should."""
        return self.swing < 0 and math.dist(self.xi, self._goal) < 0.01

    def _settle(self, dt: float) -> None:
        s = self._s
        if self.swing >= 0:
            self._landing_t += dt
            if self._landing_t >= self._landing_s:
                self.feet[self.swing] = self._landing[4]
                self._next_swing, self.swing = 1 - self.swing, -1
                self.steps += 1
        a, b = (self._middle(k) for k in (0, 1))
        if self.swing >= 0:
            place = self._landing[4]
            down = self._centre(place)
            a, b = (down, b) if self.swing == 0 else (a, down)
        self._goal = goal = (0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1]))
        loaded = (a, b) if self.swing < 0 else ((b,) if self.swing == 0 else (a,))
        com, rate = [*self.com], [*self._rate]
        for i in (0, 1):
            xi = com[i] + rate[i] / self.omega
            low = min(f[i] for f in loaded) - s.reach_m[i]
            high = max(f[i] for f in loaded) + s.reach_m[i]
            p = min(high, max(low, xi + s.settle_gain * (xi - goal[i])))
            # exact for constant p
            ch, sh = math.cosh(self.omega * dt), math.sinh(self.omega * dt)
            off = com[i] - p
            com[i] = p + off * ch + rate[i] / self.omega * sh
            rate[i] = off * self.omega * sh + rate[i] * ch
            # where the reference cannot be brought back it waits at the edge of what the legs reach
            if abs(com[i] - goal[i]) > 0.2:
                com[i], rate[i] = goal[i] + math.copysign(0.2, com[i] - goal[i]), 0.0
        self.com, self._rate = (com[0], com[1]), (rate[0], rate[1])
        self.xi = (com[0] + rate[0] / self.omega, com[1] + rate[1] / self.omega)

    def _landing_foot(self) -> tuple[Foothold, float, tuple[float, float, float]]:
        height, _, _, a, b = self._landing
        u = min(1.0, self._landing_t / self._landing_s)
        share = u * u * (3.0 - 2.0 * u)
        place = Foothold(*(p + share * (q - p) for p, q in zip(a, b, strict=True)))
        rate = 6.0 * u * (1.0 - u) / self._landing_s
        return place, height * (1.0 - u), (rate * (b.x - a.x), rate * (b.y - a.y), -height / self._landing_s)

    # --- planning ----------------------------------------------------------------------------------------------------

    def _centre(self, f: Foothold) -> tuple[float, float]:
        x = self._s.sole_x_m
        return f.x + math.cos(f.yaw) * x, f.y + math.sin(f.yaw) * x

    def _middle(self, foot: int) -> tuple[float, float]:
        return self._centre(self.feet[foot])

    def _pressure(self, foot: int, f: Foothold) -> tuple[float, float]:
        """Where the centre of pressure is planned on a foot: somewhat inwards of its middle."""
        inwards = -self._s.inset_m if foot == 0 else self._s.inset_m
        x, y = self._centre(f)
        return x - math.sin(f.yaw) * inwards, y + math.cos(f.yaw) * inwards

    def _between_feet(self, feet: list[Foothold]) -> tuple[float, float]:
        a, b = self._centre(feet[0]), self._centre(feet[1])
        return 0.5 * (a[0] + b[0]), 0.5 * (a[1] + b[1])

    def _stand(self) -> None:
        p = self._between_feet(self.feet)
        self._plan, self._t = [_Segment(_STAND_S, p, p, -1, None, 0.0)], 0.0
        self._recur()

    def _walk(self, wanted: Wanted) -> None:
        """From a stand: the weight is shifted at half speed first."""
        self._t = 0.0
        self._roll_out(self._between_feet(self.feet), wanted, 2.0 * self._s.double_s)

    def _next(self, wanted: Wanted) -> None:
        """The segment is over: take the next, and after a touch-down plan anew."""
        done = self._plan.pop(0)
        self._ends.pop(0)
        self._t -= done.duration_s
        if done.swing >= 0 and done.target is not None:
            self.feet[done.swing] = done.target
            self.swing, self._next_swing = -1, 1 - done.swing
            self.steps += 1
            self._roll_out(done.p1, wanted, self._s.double_s)
        coming = self._plan[0]
        if coming.swing >= 0:
            self.swing, self._from, self.lifted = coming.swing, self.feet[coming.swing], True

    def _roll_out(self, p: tuple[float, float], wanted: Wanted, first_s: float) -> None:
        s, feet, swing = self._s, list(self.feet), self._next_swing
        plan: list[_Segment] = []
        steps = _HORIZON if wanted.walk else 0
        double_s = first_s
        while True:
            stance = 1 - swing
            if steps > 0:
                steps -= 1
                target = self._step(feet[stance], swing, wanted.length_m, wanted)
            elif self._apart(feet):
                target = self._step(feet[stance], swing, 0.0, Wanted(walk=False))
            else:
                break
            to = self._pressure(stance, feet[stance])
            plan.append(_Segment(double_s, p, to, -1, None, 0.0))
            plan.append(_Segment(s.single_s, to, to, swing, target, s.lift_m * wanted.lift))
            feet[swing] = target
            p, swing, double_s = to, stance, s.double_s
        middle = self._between_feet(feet)
        plan.append(_Segment(_CLOSE_S, p, middle, -1, None, 0.0))
        plan.append(_Segment(_STAND_S, middle, middle, -1, None, 0.0))
        self._plan = plan
        self._recur()

    def _step(self, stance: Foothold, swing: int, length_m: float, wanted: Wanted) -> Foothold:
        yaw = stance.yaw + wanted.turn_rad
        side = self._width_m if swing == 0 else -self._width_m
        c, s, aside = math.cos(yaw), math.sin(yaw), side + wanted.aside_m
        return Foothold(stance.x + c * length_m - s * aside, stance.y + s * length_m + c * aside, yaw)

    def _apart(self, feet: list[Foothold]) -> bool:
        """Whether the feet do not stand side by side."""
        left, right = feet
        forward = math.cos(left.yaw) * (left.x - right.x) + math.sin(left.yaw) * (left.y - right.y)
        return abs(forward) > _ALIGNED_M

    def _recur(self) -> None:
        """Capture point at the end of every segment, from the last to the first."""
        ends = [self._plan[-1].p1]
        for segment in reversed(self._plan[1:]):
            ends.append(self._at(segment, ends[-1], 0.0))
        self._ends = ends[::-1]

    def _xi(self) -> tuple[float, float]:
        segment = self._plan[0]
        return segment.p1 if segment.duration_s == _STAND_S else self._at(segment, self._ends[0], self._t)

    def _at(self, segment: _Segment, end: tuple[float, float], t: float) -> tuple[float, float]:
        if segment.duration_s == _STAND_S:
            return segment.p1
        decay = math.exp(-self.omega * (segment.duration_s - t))
        result = []
        for p0, p1, e in zip(segment.p0, segment.p1, end, strict=True):
            slope = (p1 - p0) / segment.duration_s
            lead = slope / self.omega
            result.append(p0 + slope * t + lead + decay * (e - p1 - lead))
        return result[0], result[1]


def _between(t: float, times: list[float], values: list[float]) -> float:
    for a, b, va, vb in zip(times, times[1:], values, values[1:], strict=False):
        if t <= b:
            return va + (vb - va) * max(0.0, t - a) / max(1e-9, b - a)
    return values[-1]
