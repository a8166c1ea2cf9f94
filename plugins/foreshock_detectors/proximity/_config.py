"""Settings of the proximity detector, with the source of every default."""

from __future__ import annotations

import math

import msgspec

from foreshock.errors import ConfigError

__all__ = ["ProximityConfig"]

_MAY_BE_ZERO = {
    "c_m", "extrapolation_s", "human_dropout_s", "hysteresis_m", "stopping_s", "v_h_least_m_s", "z_d_m", "z_r_m",
}  # fmt: skip  # one name a line would hide the list


class ProximityConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Robot model, terms of the protective separation distance S_p (ISO/TS 15066:2016, 5.5.4), and the approach test.

    Attributes:
        urdf: URDF file; ``""`` is TALOS from the example-robot-data package of this environment.
        srdf: SRDF file with reference configurations; ``""`` is TALOS's, or none when urdf is set.
        reference: reference configuration of the SRDF; gives the position of held_joints.
        held_joints: joints that the robot does not stream; they stay at the reference configuration. Any other joint
            that is missing from the stream is an error.
        package_dirs: where ``package://`` meshes lie, beside the folders above the URDF.
        cache_dir: where fitted capsules are kept; ``""`` is ``capsules`` in $FORESHOCK_CACHE or in ~/.cache/foreshock.
        capsules: at most so many robot capsules, as far as joints can be merged; 0 is one per joint with a shape.
        reaction_s: T_r, from the measurement of a person to the command to stop: two frames of a 20 Hz tracker.
        stopping_s: T_s, until the robot stands: a walking biped stops with the end of its step, 0.6 s a step.
        stopping_speed_ratio: mean speed over T_s as a share of the speed at its start; 0.5 is constant deceleration, 1
            is right for any robot that does not speed up.
        v_h_far_m_s: v_h where it is not measured: walking, 1.6 m/s (ISO 13855:2010, 6.2).
        v_h_near_m_s: the same nearer than near_m: reaching, 2.0 m/s (ISO 13855:2010, 6.2).
        near_m: separation that parts the two: 500 mm (ISO 13855:2010, 6.2).
        v_h_least_m_s: a measured v_h counts at least so much; 0 takes the measurement as it is.
        c_m: C, intrusion distance: 8 (d - 14 mm), ISO 13855:2010, 6.2.3, for a detection capability of d = 40 mm.
        z_d_m: Z_d at least; the uncertainty that a message states counts if it is larger.
        z_r_m: Z_r: encoders (1 mrad over an arm of 1 m), odometry and joint compliance, some 5 mm each.
        fall_reach: whether S_f counts: a biped cannot stop by braking alone.
        fall_support_m: capsules whose lowest point is within this of the ground count as support: a foot in swing too.
        hysteresis_m: human-proximity-breach is withdrawn beyond S_p plus this: twice the noise of a tracked position.
        severe_closing_m_s: closing speed of severity 1: ISO 13855's 2.0 m/s.
        closing_m_s: threshold of narrowing-clearance: the sway of stepping in place beside a person closes at up to
            0.20 m/s (balance plant, 80 s), and at 20 Hz a noise of 20 mm a sample is 0.04 m/s of slope; it is above
            the one by more than three of the other, and below a slow walk of 0.5 m/s.
        closing_release_ratio: withdrawn below this share of closing_m_s.
        closing_window_s: window of the least-squares slope.
        horizon_s: narrowing counts when S_p will be reached within this time: twice T_r + T_s and some.
        extrapolation_s: a measured velocity is trusted so long; afterwards v_h runs on as part of S_h.
        human_dropout_s: a track that is missing from a live stream is carried on so long, as three frames at 20 Hz.
        human_departed_s: afterwards it is reported absent for so long; longer than the core's evidence window.
        sensor_range_m: distance stated for nobody.
        consistency_m: python-fcl and the closed form may differ by so much; more is a fault.
    """

    urdf: str = ""
    srdf: str = ""
    reference: str = "half_sitting"
    held_joints: tuple[str, ...] = ()
    package_dirs: tuple[str, ...] = ()
    cache_dir: str = ""
    capsules: int = 20
    reaction_s: float = 0.1
    stopping_s: float = 0.6
    stopping_speed_ratio: float = 0.5
    v_h_far_m_s: float = 1.6
    v_h_near_m_s: float = 2.0
    near_m: float = 0.5
    v_h_least_m_s: float = 0.0
    c_m: float = 0.208
    z_d_m: float = 0.02
    z_r_m: float = 0.01
    fall_reach: bool = True
    fall_support_m: float = 0.1
    hysteresis_m: float = 0.05
    severe_closing_m_s: float = 2.0
    closing_m_s: float = 0.35
    closing_release_ratio: float = 0.6
    closing_window_s: float = 0.5
    horizon_s: float = 1.5
    extrapolation_s: float = 0.15
    human_dropout_s: float = 0.15
    human_departed_s: float = 3.0
    sensor_range_m: float = 10.0
    consistency_m: float = 0.001

    def __post_init__(self) -> None:
        for field in self.__struct_fields__:
            value = getattr(self, field)
            if isinstance(value, float) and not (
                math.isfinite(value) and (value > 0.0 or (value == 0.0 and field in _MAY_BE_ZERO))
            ):
                wanted = "at least 0" if field in _MAY_BE_ZERO else "above 0"
                raise ConfigError(f"proximity.{field}", f"{value!r} is out of range", f"; expected a number {wanted}")
        if self.capsules < 0:
            raise ConfigError("proximity.capsules", f"{self.capsules} is negative", "; 0 is one per joint")
        for field in ("stopping_speed_ratio", "closing_release_ratio"):
            if not getattr(self, field) <= 1.0:
                raise ConfigError(f"proximity.{field}", f"{getattr(self, field)!r} is above 1")
        for low, high in (("closing_m_s", "severe_closing_m_s"), ("v_h_far_m_s", "v_h_near_m_s")):
            if not getattr(self, low) < getattr(self, high):
                a, b = getattr(self, low), getattr(self, high)
                raise ConfigError(f"proximity.{low}", f"{a!r} is not below {high} = {b!r}")
