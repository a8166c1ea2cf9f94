"""One gripper: its filters, its tests, and what they say of it."""

from __future__ import annotations

import math

from foreshock.messages import GripState
from foreshock.records import Indication, Sample, SampleRef
from foreshock_detectors._sequential import Hysteresis, RunningMedian, severity
from foreshock_detectors.grip._config import GripConfig
from foreshock_detectors.grip._filter import ForceFilter, force_filter
from foreshock_detectors.grip._tests import GATE, Tests
from foreshock_detectors.grip._transfer import Transfer

__all__ = ["Gripper"]

G = 9.80665
"""Standard gravity (m/s^2), CGPM 1901."""

LIFTED = 0.2
"""Below this share of the assumed load the object still stands on something, and its mass cannot be told."""

LEAST_LOAD_N = 1.0
"""Relative errors of mass refer to at least this load, so that a feather is not misjudged by the sensor's bias."""


class Gripper:
    """Follows one gripper sample by sample; :meth:`indications` says what it found.

    The load filter's state is the weight w that the grip carries at rest, observed as F_t = (1 + a / g) w: to
    accelerate an object changes F_t, but not w. The normal-force filter observes F_n itself.
    """

    def __init__(self, subject: str, config: GripConfig) -> None:
        self.subject, self._config = subject, config
        self._load: ForceFilter = force_filter(config.backend)
        self._grip: ForceFilter = force_filter(config.backend)
        self._transfer = Transfer(config)
        self._period = RunningMedian(least=1e-6, start=9)
        self._tests: Tests | None = None
        self._slip_hold_ns = round(config.slip_hold_s * 1e9)
        self._steady_ns = round(config.steady_s * 1e9)
        self._patience_ns = round(config.mass_patience_s * 1e9)
        self._oscillating = Hysteresis(1.0, 0.7, round(config.slip_hold_s * 1e9))
        self._wrong_mass = Hysteresis(config.mass_error, 0.8 * config.mass_error, round(1e8))
        self.malformed = False
        self._stamp_ns = -1
        self._channel = ""
        self._value: GripState | None = None
        self._release()

    def _release(self) -> None:
        """Nothing is held."""
        self._held = False
        self._slip_ns, self._slip_peak, self._slip_severity = -1, 0.0, 0.0
        self._before_n = self._drop_n = 0.0
        self._oscillation = self._band_n = self._nis = self._command_n = 0.0
        self._mass_error = 0.0
        self._lifted = self._loading = False
        self._oscillating.restart()
        self._wrong_mass.restart()

    def _restart(self, tests: Tests, stamp_ns: int, value: GripState) -> None:
        """A new grasp, or a gap in the samples: begin again from this one."""
        variance = self._config.noise_n**2
        h = 1.0 + value.vertical_acceleration / G
        load = value.tangential_force / h if h > 0.5 else value.tangential_force
        self._load.restart(load, 4.0 * variance)
        self._grip.restart(value.normal_force, variance)
        self._transfer.restart(stamp_ns, value.commanded_force, load)
        tests.restart()
        tests.command_band.push(value.normal_force)  # closing is a step from here to the command
        self._command_n = 0.0
        self._loading = True
        self._held, self._restless_ns, self._weighed_ns = True, stamp_ns, stamp_ns

    def push(self, sample: Sample) -> None:
        """Take the next sample; one that is not newer than the last is passed over."""
        value = sample.value
        if not isinstance(value, GripState) or not _sane(value):
            self.malformed = True
            return
        dt_ns = sample.stamp_ns - self._stamp_ns
        if self._stamp_ns >= 0 and dt_ns <= 0:
            return
        first, dt = self._stamp_ns < 0, dt_ns * 1e-9
        self._stamp_ns, self._channel, self._value, self.malformed = sample.stamp_ns, sample.channel, value, False
        if first:
            return
        self._period.push(dt)
        if not self._period.ready:
            return
        tests, period = self._tests, self._period.value
        if tests is None or not (0.8 < period / tests.dt < 1.25):
            tests = self._tests = Tests(self._config, period)
            self._held = False
        if not value.grasping:
            if self._held:
                self._release()
        elif not self._held or dt > 10.0 * period:
            self._restart(tests, sample.stamp_ns, value)
        else:
            self._follow(tests, sample.stamp_ns, dt, value)

    def _follow(self, tests: Tests, stamp_ns: int, dt: float, value: GripState) -> None:
        """One step of filters and tests while something is held."""
        config, transfer, load, grip = self._config, self._transfer, self._load, self._grip
        gain = value.vertical_acceleration / G
        weight = load.force
        noise = config.noise_n**2
        variance = noise + (weight * config.acceleration_noise_m_s2 / G) ** 2
        transfer.push(stamp_ns, dt, value.commanded_force, value.tangential_force - weight * gain, math.sqrt(variance))
        free = transfer.released or transfer.loading
        rate_noise = config.transfer_rate_noise if free else config.load_rate_noise
        if not transfer.loading and self._loading:
            tests.slip.restart()
        self._loading = transfer.loading
        z_load = load.step(value.tangential_force, dt, 1.0 + gain, variance, rate_noise * rate_noise, GATE)
        moving = transfer.excused(stamp_ns)
        rate_noise = config.command_rate_noise if moving else config.grip_rate_noise
        z_grip = grip.step(value.normal_force, dt, 1.0, noise, rate_noise * rate_noise, GATE)

        slip = tests.slip
        if slip.value == 0.0:
            self._before_n = weight
        lost, gained = slip.push(-z_load), tests.rise.push(z_load)
        if stamp_ns - self._slip_ns >= self._slip_hold_ns or slip.value > self._slip_peak:
            self._slip_peak = slip.value
        if lost and transfer.rising:
            lost, slip.value = False, slip.threshold  # the rate fell, not the load: the end of a pick-up
        if lost or gained:
            left = value.tangential_force / (1.0 + gain) if gain > -0.5 else weight
            load.restart(left, 4.0 * noise)
            if lost:
                self._slipped(stamp_ns, left)
                slip.restart()
            else:
                transfer.rises(stamp_ns)
                tests.rise.restart()
        self._oscillate(tests, stamp_ns, value, value.tangential_force - load.force * gain, (z_load, z_grip))
        self._weigh(stamp_ns, value, free or moving)

    def _slipped(self, stamp_ns: int, left_n: float) -> None:
        """Load was lost: note how much. Half of it lost is as bad as it gets before the object falls."""
        if self._slip_ns < 0 or stamp_ns - self._slip_ns >= self._slip_hold_ns:
            self._slip_severity = 0.0
        self._drop_n = self._before_n - left_n
        self._slip_severity = max(self._slip_severity, severity(self._drop_n, 0.0, max(0.5 * self._before_n, 0.1)))
        self._slip_ns = self._restless_ns = stamp_ns

    def _oscillate(self, tests: Tests, stamp_ns: int, value: GripState, load_n: float, z: tuple[float, float]) -> None:
        """Band energy of both forces beyond what the command explains, and the scatter of their innovations."""
        transfer = self._transfer
        grip_band, command = tests.grip_band.push(value.normal_force), tests.command_band.push(value.commanded_force)
        # A stable loop without resonance amplifies no frequency: its response cannot hold more energy than the command,
        # only hold it later. So the command's peak counts while it moves and then fades as the response does.
        peak = self._command_n
        self._command_n = max(command, peak) if transfer.excused(stamp_ns) else peak * tests.decay
        limit = tests.band_rms_n
        ratio = grip_band / (limit + self._command_n)
        if transfer.released or transfer.rising:  # a transfer is itself a step inside the band
            tests.load_band.restart()
            tests.load_scatter.restart()
            load_band = 0.0
        else:
            load_band = tests.load_band.push(load_n)
            ratio = max(ratio, load_band / limit)
            tests.load_scatter.push(z[0])
        tests.grip_scatter.push(z[1])
        self._nis = max(tests.load_scatter.value, tests.grip_scatter.value)
        self._band_n = max(load_band, grip_band)
        self._oscillation = max(ratio, self._nis / tests.load_scatter.threshold)
        self._oscillating.push(self._oscillation, stamp_ns)

    def _weigh(self, stamp_ns: int, value: GripState, free: bool) -> None:
        """The load at rest against the planner's mass, once it is still."""
        config, load = self._config, self._load
        if free or abs(load.rate) > 2.0:
            self._restless_ns = stamp_ns
        assumed = value.object_mass * G
        excess = load.force - assumed
        self._mass_error = excess / max(assumed, LEAST_LOAD_N)
        if load.force > LIFTED * assumed:
            self._lifted = True
        if stamp_ns - self._restless_ns < self._steady_ns:
            return
        self._weighed_ns = stamp_ns
        sure = abs(excess) > config.force_bias_n + config.mass_significance * math.sqrt(load.force_variance)
        self._wrong_mass.push(abs(self._mass_error) if sure and self._lifted else 0.0, stamp_ns)

    @property
    def observed(self) -> bool:
        """Whether enough is known to say anything."""
        return self._tests is not None and not self.malformed

    @property
    def mass_observed(self) -> bool:
        """Whether the mass could be judged lately, or there is none to judge."""
        return not self._held or self._stamp_ns - self._weighed_ns < self._patience_ns

    def indications(self) -> tuple[Indication, Indication, Indication]:
        """Micro-slip, oscillation and mass misestimation now. Only if :attr:`observed`."""
        tests, value = self._tests, self._value
        assert tests is not None  # noqa: S101  # observed
        assert value is not None  # noqa: S101  # observed
        stamp, limit = self._stamp_ns, self._config.mass_error
        evidence = (SampleRef(self._channel, stamp),)
        if not self._held:
            idle = {"held": 0.0}
            h, subject = tests.slip.threshold, self.subject
            return (
                Indication("grip-micro-slip", subject, stamp, False, 0.0, h, "1", 0.0, evidence, None, idle),
                Indication("grip-oscillation", subject, stamp, False, 0.0, 1.0, "1", 0.0, evidence, None, idle),
                Indication("mass-misestimation", subject, stamp, False, 0.0, limit, "1", 0.0, evidence, None, idle),
            )
        load, grip, transfer = self._load.force, self._grip.force, self._transfer
        slipping = self._slip_ns >= 0 and stamp - self._slip_ns < self._slip_hold_ns
        cone = self._config.friction * self._config.contacts * max(grip, 1e-3)
        slip = {
            "held": 1.0,
            "load_n": load,
            "load_rate_n_s": self._load.rate,
            "drop_n": self._drop_n,
            "friction_use": abs(value.tangential_force) / cone,
            "transfer": float(transfer.released or transfer.loading),
        }
        oscillation = {
            "held": 1.0,
            "band_rms_n": self._band_n,
            "nis_ratio": self._nis,
            "grip_n": grip,
            "grip_rate_n_s": self._grip.rate,
            "transfer": float(transfer.commanded),
        }
        mass = {
            "held": 1.0,
            "mass_kg": load / G,
            "load_sd_n": math.sqrt(self._load.force_variance),
            "steady": float(stamp - self._restless_ns >= self._steady_ns),
            "lifted": float(self._lifted),
        }
        shaking, wrong, error = self._oscillating.present, self._wrong_mass.present, abs(self._mass_error)
        peak = self._slip_peak if slipping else tests.slip.value
        return (
            Indication(
                "grip-micro-slip", self.subject, stamp, slipping, peak, tests.slip.threshold, "1",
                self._slip_severity if slipping else 0.0, evidence, None, slip,
            ),
            Indication(
                "grip-oscillation", self.subject, stamp, shaking, self._oscillation, 1.0, "1",
                severity(self._oscillation, 1.0, 5.0) if shaking else 0.0, evidence, None, oscillation,
            ),
            Indication(
                "mass-misestimation", self.subject, stamp, wrong, error, limit, "1",
                severity(error, limit, 1.0) if wrong and limit < 1.0 else float(wrong), evidence, None, mass,
            ),
        )  # fmt: skip


def _sane(value: GripState) -> bool:
    """Whether every number is finite and the assumed mass is one."""
    total = value.normal_force + value.tangential_force + value.commanded_force + value.vertical_acceleration
    return math.isfinite(total + value.opening + value.object_mass) and value.object_mass >= 0.0
