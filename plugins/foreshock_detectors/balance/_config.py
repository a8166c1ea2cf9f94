"""Settings of the balance detector, with the source of every default."""

from __future__ import annotations

import math

import msgspec

from foreshock.errors import ConfigError

__all__ = ["BalanceConfig"]

_MAY_BE_NEGATIVE = {"sole_x_min_m", "sole_x_max_m"}
_MAY_BE_ZERO = {"acceleration_filter_s", "torso_filter_s", "gyro_bias_limit_rad_s"}


class BalanceConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Robot model, sole geometry, thresholds and filters. The defaults are for TALOS.

    Attributes:
        urdf: URDF file; ``""`` is TALOS from the example-robot-data package of this environment.
        srdf: SRDF file with reference configurations; ``""`` is TALOS's, or none when urdf is set.
        reference: reference configuration of the SRDF; gives the position of held_joints.
        held_joints: joints that the robot does not stream; they stay at the reference configuration. Any other joint
            that is missing from the stream is an error.
        left_sole_frame: frame on the left sole's surface, x forward, z up out of the ground.
        right_sole_frame: the same for the right.
        sole_x_min_m: heel edge of the sole rectangle in its frame (TALOS's collision mesh).
        sole_x_max_m: toe edge.
        sole_y_half_m: half width.
        torso_frame: frame whose roll is the torso's.
        imu_frame: frame of the gyroscope's axes; ``""`` takes the frame_id of each message. Only the cross-check of
            the IMU against the joints needs it.
        gravity_m_s2: g.
        contact_on_n: a sole carries load above this vertical force; about a tenth of TALOS's weight.
        contact_off_n: it no longer does below this.
        com_deviation_m: threshold of com-lateral-deviation; nominal stepping in place of the frontal-plane model
            stays below it in 50 runs of 60 s. Where there is no motion plan, half of the nominal sway is added: the
            sway that the robot intends cannot be told from a deviation then.
        com_deviation_full_m: deviation of severity 1: the CoM of a centred TALOS stands over the middle of one foot.
        com_nominal_s: time constant of the running nominal that stands in where there is no motion plan.
        capture_margin_full_m: capture point this far outside of both soles is severity 1: half a sole's width.
        capture_tolerance_m: a fall is predicted when the capture point is farther outside than this; it covers the
            noise of a CoM velocity of 15 mm/s.
        fall_horizon_s: a predicted fall later than this is not reported.
        torso_rate_rad_s: threshold of torso-angular-spike, roll and pitch together. Same source as com_deviation_m.
        torso_rate_full_rad_s: rate of severity 1.
        torso_filter_s: time constant of the gyroscope's low pass.
        gyro_bias_limit_rad_s: largest bias that is estimated and taken off; MEMS gyroscopes stay below 1 degree/s.
        gyro_bias_s: time constant of that estimate.
        sway_ratio: threshold of sway-amplitude-increase, as a multiple of the nominal amplitude.
        sway_ratio_full: ratio of severity 1.
        sway_window_s: one gait cycle of two steps of 0.6 s.
        sway_learn_s: time over which the nominal amplitude is learned.
        sway_com_nominal_m: least nominal peak-to-peak lateral CoM sway: stepping in place at 0.6 s a step.
        sway_roll_nominal_rad: least nominal peak-to-peak torso roll: the largest in 7.5 minutes of nominal stepping of
            the balance plant was 0.104 rad (seeds 40 to 45, 75 s each), and its tail is heavy.
        sway_learn_limit: learning raises a nominal amplitude at most to this multiple of the least one.
        slip_m: threshold of foot-micro-slip. Same source as com_deviation_m.
        slip_full_m: displacement of severity 1.
        slip_settle_s: a sole counts as set down after carrying load for this long: a third of double support, while
            the load is still below half of the weight. Sooner, a foot that is set down beside one that has slid is
            found to slip too: the legs draw it in by some 2 mm until it bears load (frontal-plane model).
        slip_forget_s: displacement leaks away with this time constant, so that drift of the odometry slower than
            slip_m / slip_forget_s is no slip and a slip that has ended is cleared.
        slip_sigmas: the threshold is never below so many standard deviations of the estimated displacement.
        sole_position_sd_m: noise of one sole position in odom (odometry and encoders together).
        sole_velocity_sd_m_s: noise of one sole velocity in odom.
        jump_m: a sole position that contradicts position and velocity so far by more than this is a jump of odometry.
        release_ratio: an indication is withdrawn below this share of its threshold.
        acceleration_filter_s: time constant of the filter behind the derivative of the centroidal momentum.
        gap_s: after a gap of this length in the stream the filters start anew.
    """

    urdf: str = ""
    srdf: str = ""
    reference: str = "half_sitting"
    held_joints: tuple[str, ...] = ()
    left_sole_frame: str = "left_sole_link"
    right_sole_frame: str = "right_sole_link"
    sole_x_min_m: float = -0.105
    sole_x_max_m: float = 0.10
    sole_y_half_m: float = 0.06
    torso_frame: str = "torso_2_link"
    imu_frame: str = ""
    gravity_m_s2: float = 9.81
    contact_on_n: float = 100.0
    contact_off_n: float = 60.0
    com_deviation_m: float = 0.040
    com_deviation_full_m: float = 0.085
    com_nominal_s: float = 5.0
    capture_margin_full_m: float = 0.06
    capture_tolerance_m: float = 0.005
    fall_horizon_s: float = 2.0
    torso_rate_rad_s: float = 0.6
    torso_rate_full_rad_s: float = 1.5
    torso_filter_s: float = 0.008
    gyro_bias_limit_rad_s: float = 0.02
    gyro_bias_s: float = 5.0
    sway_ratio: float = 1.5
    sway_ratio_full: float = 3.0
    sway_window_s: float = 1.2
    sway_learn_s: float = 6.0
    sway_com_nominal_m: float = 0.055
    sway_roll_nominal_rad: float = 0.11
    sway_learn_limit: float = 1.5
    slip_m: float = 0.002
    slip_full_m: float = 0.02
    slip_settle_s: float = 0.05
    slip_forget_s: float = 1.5
    slip_sigmas: float = 5.0
    sole_position_sd_m: float = 0.001
    sole_velocity_sd_m_s: float = 0.01
    jump_m: float = 0.01
    release_ratio: float = 0.7
    acceleration_filter_s: float = 0.05
    gap_s: float = 0.1

    def __post_init__(self) -> None:
        for field in self.__struct_fields__:
            value = getattr(self, field)
            if isinstance(value, float):
                _check_number(field, value)
        for low, high in (
            ("sole_x_min_m", "sole_x_max_m"),
            ("contact_off_n", "contact_on_n"),
            ("com_deviation_m", "com_deviation_full_m"),
            ("torso_rate_rad_s", "torso_rate_full_rad_s"),
            ("gyro_bias_limit_rad_s", "torso_rate_rad_s"),
            ("sway_ratio", "sway_ratio_full"),
            ("slip_m", "slip_full_m"),
        ):
            a, b = getattr(self, low), getattr(self, high)
            if not a < b:
                raise ConfigError(f"balance.{low}", f"{a!r} is not below {high} = {b!r}")
        for field, least, most in (("release_ratio", 0.0, 1.0), ("sway_ratio", 1.0, math.inf)):
            if not least < getattr(self, field) <= most:
                raise ConfigError(f"balance.{field}", f"{getattr(self, field)!r} is not in ({least}, {most}]")
        if not self.sway_learn_limit >= 1.0:
            raise ConfigError("balance.sway_learn_limit", f"{self.sway_learn_limit!r} is below 1")


def _check_number(field: str, value: float) -> None:
    if not math.isfinite(value):
        raise ConfigError(f"balance.{field}", f"{value!r} is not a finite number")
    if field in _MAY_BE_NEGATIVE:
        return
    if value < 0.0 or (value == 0.0 and field not in _MAY_BE_ZERO):
        wanted = "at least 0" if field in _MAY_BE_ZERO else "above 0"
        raise ConfigError(f"balance.{field}", f"{value!r} is out of range", f"; expected a number {wanted}")
