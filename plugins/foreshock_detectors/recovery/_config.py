"""Configuration of the recovery detector."""

from __future__ import annotations

import math

import msgspec

from foreshock.errors import ConfigError

__all__ = ["RecoveryConfig"]

_MAY_BE_ZERO = ("c_m", "z_d_m", "z_r_m", "hysteresis_m", "hold_s")


class RecoveryConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Settings, with where each default comes from.

    Attributes:
        arms: arm to its joints, and of each joint the distance from its axis to the fingertips, arm stretched (m). An
            arm is a subject; its hand is read from ``<arm>/odometry``. Defaults: TALOS from shoulder and from elbow.
        hips: joints that turn the trunk against the legs.
        arm_speed_m_s: unplanned speed of an arm that counts. Where a hand of effective mass m_r meets a chest (40 kg,
            25 N/mm, 280 N transient), the limit is reached at v = F / sqrt(mu k), mu = 1 / (1 / m_r + 1 / m_h)
            (ISO/TS 15066, A.3.6): 0.8 m/s for m_r = 5.8 kg, both forearms of TALOS and a small load.
        arm_speed_full_m_s: speed of severity 1: twice the effect of the speed of an unhurried reach, 1.0 m/s.
        torso_rate_rad_s: the trunk turns against its legs at this rate or faster. Shoulders 0.45 m above the hips pass
            the reduced speed of 250 mm/s (ISO 10218-1) at 0.56 rad/s; walking and lifting turn them at 0.35 rad/s.
        torso_rate_full_rad_s: rate of severity 1.
        reaction_s: T_r, from the measurement to the command to stop: two frames of a 20 Hz tracker.
        stopping_s: T_s, until the arm stands: balance has priority over a stop, so that an arm thrown to save it
            comes to rest with the end of its swing; a stretched arm of 0.7 m, a rod, swings with a period of 1.4 s.
        stopping_speed_ratio: mean speed over T_s as a share of that at its start; 0.5 is constant deceleration.
        v_h_m_s: speed of a person that is not measured: reaching, 2.0 m/s (ISO 13855:2010, 6.2).
        c_m: C, intrusion distance; 0 where perception tracks the whole body and no limb is hidden from it.
        z_d_m: Z_d at least; the uncertainty that a message states counts if it is larger.
        z_r_m: Z_r: encoders (1 mrad over an arm of 1 m), odometry and joint compliance, some 5 mm each.
        hysteresis_m: human-proximity-breach is withdrawn beyond S_p plus this: twice the noise of a tracked position.
        severe_closing_m_s: speed of the hand of severity 1: ISO 13855's 2.0 m/s.
        hold_s: how long a kind stays present below its release threshold (s): a swing turns round in less.
        release_ratio: an arm or a trunk is slow again below this share of its threshold.
    """

    arms: dict[str, dict[str, float]] = msgspec.field(
        default_factory=lambda: {"arm": {"shoulder": 0.69, "elbow": 0.42}}
    )
    hips: tuple[str, ...] = ("hip",)
    arm_speed_m_s: float = 0.8
    arm_speed_full_m_s: float = 2.0
    torso_rate_rad_s: float = 0.8
    torso_rate_full_rad_s: float = 2.0
    reaction_s: float = 0.1
    stopping_s: float = 0.3
    stopping_speed_ratio: float = 0.5
    v_h_m_s: float = 2.0
    c_m: float = 0.0
    z_d_m: float = 0.02
    z_r_m: float = 0.01
    hysteresis_m: float = 0.02
    severe_closing_m_s: float = 2.0
    hold_s: float = 0.2
    release_ratio: float = 0.7

    def __post_init__(self) -> None:
        """Check the ranges.

        Raises:
            ConfigError: names the setting and its value.
        """
        if not self.arms or not self.hips or not all(self.hips):
            raise ConfigError("recovery", f"needs arms and hips, not {sorted(self.arms)} and {list(self.hips)}")
        levers = [
            (f"arms.{arm}.{joint}", lever) for arm, joints in self.arms.items() for joint, lever in joints.items()
        ]
        for arm, joints in self.arms.items():
            if not arm or not joints:
                raise ConfigError(f"recovery.arms.{arm}", "has no joints; expected joint = metres to the fingertips")
        named = [(f, getattr(self, f)) for f in self.__struct_fields__ if f not in ("arms", "hips")]
        for name, value in levers + named:
            if not (math.isfinite(value) and (value > 0.0 or (value == 0.0 and name in _MAY_BE_ZERO))):
                least = "not negative" if name in _MAY_BE_ZERO else "positive"
                raise ConfigError(f"recovery.{name}", f"must be finite and {least}, not {value}")
        for low, high in (("arm_speed_m_s", "arm_speed_full_m_s"), ("torso_rate_rad_s", "torso_rate_full_rad_s")):
            if not getattr(self, low) < getattr(self, high):
                raise ConfigError(
                    f"recovery.{low}", f"{getattr(self, low)} is not below {high} = {getattr(self, high)}"
                )
        for name in ("release_ratio", "stopping_speed_ratio"):
            if getattr(self, name) > 1.0:
                raise ConfigError(f"recovery.{name}", f"{getattr(self, name)} is above 1")
