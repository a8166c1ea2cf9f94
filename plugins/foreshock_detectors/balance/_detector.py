"""The balance detector: samples in, four kinds of indication out."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

from foreshock.clock import NS_PER_S
from foreshock.detector import Inputs
from foreshock.messages import Vec3
from foreshock.records import Indication, Sample, SampleRef
from foreshock_detectors.balance._com import ComDeviation
from foreshock_detectors.balance._config import BalanceConfig
from foreshock_detectors.balance._kinematics import BodyState, Kinematics, SolePose
from foreshock_detectors.balance._model import RobotModel
from foreshock_detectors.balance._signals import Hysteresis, ramp, weight
from foreshock_detectors.balance._slip import FootSlip
from foreshock_detectors.balance._stability import FootContact, Stability
from foreshock_detectors.balance._support import Load
from foreshock_detectors.balance._sway import NominalAmplitude, Swing
from foreshock_detectors.balance._torso import TorsoRate

__all__ = ["BalanceDetector"]

FEET = ("left", "right")


class BalanceDetector:
    """Reports foot-micro-slip, torso-angular-spike, com-lateral-deviation and sway-amplitude-increase.

    The body is evaluated once per joint state that is newer than the last, whatever the rate; a repeated or late one
    changes nothing. A kind whose evidence is missing or malformed is left out of the answer, hence unobserved:

    - joint state and odometry are needed by all kinds but the torso's; malformed, they raise ValueError or ConfigError;
    - without the IMU there is no torso-angular-spike;
    - without both sole wrenches there is no foot-micro-slip and no ZMP. Where only one foot is observed, it is reported
      while its slip is present, else the whole kind is left out: absence would speak for both feet;
    - sway-amplitude-increase needs a full window, unless the amplitude is already too large before.
    """

    def __init__(self, config: BalanceConfig) -> None:
        self._config = config
        self._robot = RobotModel(config)
        self.reset(0)

    def reset(self, seed: int) -> None:  # noqa: ARG002  # part of the port; nothing here is random
        """Forget everything."""
        config = self._config
        self._kinematics = Kinematics(self._robot)
        self._stamp_ns = self._window_ns = -1
        self._loads = {foot: Load(config) for foot in FEET}
        self._slips = {foot: FootSlip(config) for foot in FEET}
        self._com = ComDeviation(config)
        self._stability = Stability(config, self._robot.mass_kg)
        self._torso = TorsoRate(config)
        self._disagreement: list[float] | None = None
        self._planned = False
        self._sway = Hysteresis(config.release_ratio)
        least_m, least_rad = config.sway_com_nominal_m, config.sway_roll_nominal_rad
        # a tenth of the nominal amplitude turns a half swing round: above the noise, far below what is judged
        self._com_swing = Swing(config.sway_window_s, 0.1 * least_m)
        self._plan_swing = Swing(config.sway_window_s, 0.1 * least_m)
        self._roll_swing = Swing(config.sway_window_s, 0.1 * least_rad)
        self._com_nominal = NominalAmplitude(config, least_m)
        self._roll_nominal = NominalAmplitude(config, least_rad)
        self._body_answer: list[Indication] = []
        self._slip_answer: list[Indication] = []

    def update(self, now_ns: int, inputs: Inputs) -> Sequence[Indication]:  # noqa: ARG002  # time comes from the stamps
        """One indication per observed kind and subject."""
        latest = inputs.latest
        imu = self._take_imu(inputs)
        joints, odometry = latest.get("joints"), latest.get("odometry")
        answer: list[Indication] = []
        if joints is not None and odometry is not None:
            if joints.stamp_ns > self._stamp_ns:
                self._advance(joints, odometry, imu, inputs)
            answer += self._body_answer
            if "left_wrench" in latest and "right_wrench" in latest:
                answer += self._slip_answer
            else:
                answer += [i for i in self._slip_answer if i.present and f"{i.subject}_wrench" in latest]
        if imu is not None:
            answer.append(self._torso_indication(imu))
        return answer

    def _advance(self, joints: Sample, odometry: Sample, imu: Sample | None, inputs: Inputs) -> None:
        stamp_ns = joints.stamp_ns
        body = self._kinematics.evaluate(stamp_ns, _value(joints), _value(odometry), stamp_ns - odometry.stamp_ns)
        dt_s = (stamp_ns - self._stamp_ns) / NS_PER_S
        if self._stamp_ns < 0 or dt_s > self._config.gap_s:
            self._restart(stamp_ns)
        self._stamp_ns = stamp_ns
        wrenches = self._take_wrenches(body, inputs)
        refs = [_ref(joints), _ref(odometry)]
        of_foot = {foot: _ref(sample) for foot, sample in wrenches.items()}
        newest_ns = max(stamp_ns, odometry.stamp_ns)
        plan = inputs.latest.get("plan")
        planned_m = _value(plan).com[1] if plan is not None else math.nan
        if not math.isfinite(planned_m):
            plan, planned_m = None, None
        self._planned |= plan is not None
        self._com.update(body, planned_m, self._com_nominal.value)
        self._stability.update(body, self._contacts(wrenches))
        self._cross_check(imu, dt_s)
        self._slip_answer = self._slip_indications(body, (*refs,), newest_ns, of_foot)
        refs += of_foot.values()
        if plan is not None:
            refs.append(_ref(plan))
        evidence, newest_ns = tuple(refs), max([ref.stamp_ns for ref in refs])
        # a plan that is lost widens the threshold: what is below it then says nothing, and is not reported
        speaks = planned_m is not None or not self._planned or self._com.present
        self._body_answer = [self._com_indication(evidence, newest_ns)] if speaks else []
        sway = self._sway_indication(body, planned_m, evidence, newest_ns)
        if sway is not None:
            self._body_answer.append(sway)

    def _restart(self, stamp_ns: int) -> None:
        """The stream begins, or begins again after a gap: windows and anchors from before say nothing now."""
        self._window_ns = stamp_ns
        for swing in (self._com_swing, self._plan_swing, self._roll_swing):
            swing.reset()
        for slip in self._slips.values():
            slip.lose()

    def _take_wrenches(self, body: BodyState, inputs: Inputs) -> dict[str, Sample]:
        """Update load and slip of each foot; the samples of those whose wrench is there and finite."""
        found: dict[str, Sample] = {}
        for foot, sole in zip(FEET, (body.left, body.right), strict=True):
            sample = inputs.latest.get(f"{foot}_wrench")
            if sample is None or not math.isfinite(sum(_value(sample).force) + sum(_value(sample).torque)):
                self._slips[foot].lose()
                continue
            load = self._loads[foot]
            load.update(_vertical(sole, _value(sample).force))
            self._slips[foot].update(body.stamp_ns, sole, loaded=load.loaded)
            found[foot] = sample
        return found

    def _contacts(self, wrenches: dict[str, Sample]) -> tuple[FootContact, FootContact] | None:
        if len(wrenches) < len(FEET):
            return None
        left, right = _value(wrenches["left"]), _value(wrenches["right"])
        return (
            (self._loads["left"].loaded, left.force, left.torque),
            (self._loads["right"].loaded, right.force, right.torque),
        )

    def _take_imu(self, inputs: Inputs) -> Sample | None:
        """Filter every new gyroscope sample, by stamp; the newest sample, or None if it is missing or malformed."""
        newest = inputs.latest.get("imu")
        if newest is None:
            return None
        samples = inputs.new.get("imu", ())
        if len(samples) > 1:
            samples = sorted(samples, key=_stamp)
        for sample in (*samples, newest):
            if sample.stamp_ns > self._torso.stamp_ns and not self._torso.update(sample.stamp_ns, _value(sample)):
                return None
        return newest

    def _cross_check(self, imu: Sample | None, dt_s: float) -> None:
        """Low-passed difference between the gyroscope and what base and joints say of its frame."""
        if imu is None:
            self._disagreement = None
            return
        rate = self._kinematics.angular_velocity(self._config.imu_frame or _value(imu).frame_id)
        if rate is None:
            return
        raw = [g - r for g, r in zip(_value(imu).angular_velocity, rate, strict=True)]
        last = self._disagreement
        if last is not None:
            k = weight(dt_s, self._config.acceleration_filter_s)
            raw = [a + k * (b - a) for a, b in zip(last, raw, strict=True)]
        self._disagreement = raw

    def _slip_indications(
        self, body: BodyState, state: tuple[SampleRef, ...], newest_ns: int, wrenches: dict[str, SampleRef]
    ) -> list[Indication]:
        """For the feet of these wrenches; state are the other samples behind them, newest_ns their newest stamp."""
        observed = [foot for foot in wrenches if self._slips[foot].observed]
        answer = []
        for foot, sole in zip(FEET, (body.left, body.right), strict=True):
            slip, load = self._slips[foot], self._loads[foot]
            present = slip.present
            if foot not in observed or (len(observed) < len(FEET) and not present):
                continue
            wrench = wrenches[foot]
            answer.append(
                Indication(
                    kind="foot-micro-slip",
                    subject=foot,
                    stamp_ns=max(newest_ns, wrench.stamp_ns),
                    present=present,
                    statistic=slip.slip_m,
                    threshold=slip.threshold_m,
                    unit="m",
                    severity=ramp(slip.slip_m, self._config.slip_m, self._config.slip_full_m) if present else 0.0,
                    evidence=(*state, wrench),
                    time_to_event_s=self._stability.time_to_fall_s if present else None,
                    measures={
                        "loaded": float(load.loaded),
                        "load_n": load.force_n,
                        "sole_speed_m_s": math.hypot(sole.vx, sole.vy),
                        "slip_sd_m": slip.sd_m,
                    },
                )
            )
        return answer

    def _torso_indication(self, imu: Sample) -> Indication:
        config, torso = self._config, self._torso
        measures = {}
        if self._disagreement is not None:
            measures["rate_disagreement_rad_s"] = math.sqrt(sum(d * d for d in self._disagreement))
        rate = torso.rate_rad_s
        return Indication(
            kind="torso-angular-spike",
            subject="",
            stamp_ns=torso.stamp_ns,
            present=torso.present,
            statistic=rate,
            threshold=config.torso_rate_rad_s,
            unit="rad/s",
            severity=ramp(rate, config.torso_rate_rad_s, config.torso_rate_full_rad_s) if torso.present else 0.0,
            evidence=(SampleRef(imu.channel, torso.stamp_ns),),
            time_to_event_s=self._stability.time_to_fall_s if torso.present else None,
            measures=measures,
        )

    def _com_indication(self, evidence: tuple[SampleRef, ...], newest_ns: int) -> Indication:
        config, com, stability = self._config, self._com, self._stability
        severity = 0.0
        if com.present:
            full_m = com.threshold_m + config.com_deviation_full_m - config.com_deviation_m
            severity = ramp(abs(com.deviation_m), com.threshold_m, full_m)
            if stability.capture_margin_m is not None:
                severity = max(severity, ramp(-stability.capture_margin_m, 0.0, config.capture_margin_full_m))
        return Indication(
            kind="com-lateral-deviation",
            subject="",
            stamp_ns=newest_ns,
            present=com.present,
            statistic=abs(com.deviation_m),
            threshold=com.threshold_m,
            unit="m",
            severity=severity,
            evidence=evidence,
            time_to_event_s=stability.time_to_fall_s,
            measures={"com_deviation_m": com.deviation_m, **stability.measures},
        )

    def _sway_indication(
        self, body: BodyState, planned_m: float | None, evidence: tuple[SampleRef, ...], newest_ns: int
    ) -> Indication | None:
        """Largest oscillation of the last window, as a multiple of the nominal one, of torso roll or CoM."""
        config = self._config
        com_m = self._com_swing.update(body.stamp_ns, self._com.offset_m)
        roll_rad = self._roll_swing.update(body.stamp_ns, body.torso_roll_rad)
        self._com_nominal.update(body.stamp_ns, com_m)
        self._roll_nominal.update(body.stamp_ns, roll_rad)
        com_nominal_m = self._com_nominal.value
        if planned_m is not None:
            com_nominal_m = max(com_nominal_m, self._plan_swing.update(body.stamp_ns, planned_m))
        ratio = max(com_m / com_nominal_m, roll_rad / self._roll_nominal.value)
        present = self._sway.judge(ratio, config.sway_ratio)
        full_window = body.stamp_ns - self._window_ns >= config.sway_window_s * NS_PER_S
        if not present and not full_window:
            return None
        return Indication(
            kind="sway-amplitude-increase",
            subject="",
            stamp_ns=newest_ns,
            present=present,
            statistic=ratio,
            threshold=config.sway_ratio,
            unit="1",
            severity=ramp(ratio, config.sway_ratio, config.sway_ratio_full) if present else 0.0,
            evidence=evidence,
            time_to_event_s=self._stability.time_to_fall_s if present else None,
            measures={
                "com_amplitude_m": com_m,
                "com_nominal_m": com_nominal_m,
                "roll_amplitude_rad": roll_rad,
                "roll_nominal_rad": self._roll_nominal.value,
            },
        )


def _value(sample: Sample) -> Any:
    """The message; its type is what the spec declares for the input, which the core checks."""
    return sample.value


def _stamp(sample: Sample) -> int:
    return sample.stamp_ns


def _vertical(sole: SolePose, force: Vec3) -> float:
    zx, zy, zz = sole.rotation[2]
    return zx * force[0] + zy * force[1] + zz * force[2]


def _ref(sample: Sample) -> SampleRef:
    return SampleRef(sample.channel, sample.stamp_ns)
