"""The twin port over MuJoCo: physics at 1 kHz; control, sensors and referee at 200 Hz."""

from __future__ import annotations

import copy
import math
from collections import deque
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import mujoco
import numpy as np

from foreshock.clock import NS_PER_S
from foreshock.errors import BadInputError, TwinError
from foreshock.records import Intervention, Sample
from foreshock.twin import Channel, Parameters, TwinEvent
from foreshock_twins.mujoco._channels import PERIOD_NS, Channels
from foreshock_twins.mujoco._control import ACTIONS, Controller
from foreshock_twins.mujoco._disturb import Disturbances
from foreshock_twins.mujoco._model import STEP_S, Body, Floats
from foreshock_twins.mujoco._parameters import values_of
from foreshock_twins.mujoco._people import People
from foreshock_twins.mujoco._poses import Poses
from foreshock_twins.mujoco._referee import Referee
from foreshock_twins.mujoco._sensors import Measured, Sensors

__all__ = ["MujocoTwin"]

_SUBSTEPS = round(PERIOD_NS / NS_PER_S / STEP_S)
_KEPT = 256
"""Measurements that are kept: 1.28 s, more than any latency and lag together."""
_SENSORS, _CAMERA, _HANDS = 1, 2, 3
_WARNINGS = mujoco.mjtWarning
_DIVERGED = tuple(int(getattr(_WARNINGS, f"mjWARN_BAD{k}")) for k in ("QPOS", "QVEL", "QACC", "CTRL"))
"""What MuJoCo counts instead of raising; it would also write MUJOCO_LOG.TXT where the program runs."""
mujoco.set_mju_user_warning(lambda _: None)
_LOADED_N = 10.0
_NEAR_M, _FALL_M = 1.0, 2.0
"""A human farther than this from the base, beyond arms (and a fall), is not looked for at each step."""


class MujocoTwin:
    """A stepped twin. Call reset first.

    Attributes:
        model: MuJoCo's model of this run.

    Args:
        robot: prefix of the channels.
        body: the robot and the things in its world.
        people: the human.
    """

    def __init__(self, robot: str, body: Body, people: People) -> None:
        self._robot, self._body, self._people = robot, body, people
        self._control = Controller(body, PERIOD_NS)
        self._sensors = Sensors(body)
        self._disturbances = Disturbances(body)
        self._out = Channels(body, self._control)
        legs = frozenset(int(body.model.jnt_bodyid[body.model.joint(body.joints[k]).id]) for k in body.legs)
        self._referee = Referee(body.com_height_m, legs)
        self._poses = Poses()
        self._floor_geoms = frozenset(body.model.geom(n).id for n in ("floor", "block"))
        self.model = body.model
        self._ready = False

    @property
    def channels(self) -> Sequence[Channel]:
        """What it streams."""
        return (*self._out.declared, *self._people.channels)

    @property
    def period_ns(self) -> int:
        """A control tick, 5 ms."""
        return PERIOD_NS

    @property
    def stepped(self) -> bool:
        """True: time passes in advance() alone."""
        return True

    @property
    def actions(self) -> frozenset[str]:
        """What the controller understands."""
        return ACTIONS

    def reset(self, parameters: Parameters, seed: int) -> None:
        """Back to time 0, in the reference posture with the knees a little more bent.

        Raises:
            ConfigError: an unknown parameter, or a value outside its range.
        """
        self._ready = False
        p = self._p = values_of(parameters)
        self.model = copy.copy(self._body.model)
        self._data = mujoco.MjData(self.model)
        self._disturbances.reset(p, self.model, self._data)
        self._sensors.reset(p, *(np.random.default_rng([seed % 2**63, k]) for k in (_SENSORS, _HANDS)))
        self._people.reset(p, self.model, self._data, np.random.default_rng([seed % 2**63, _CAMERA]))
        q = self._control.reset(p)
        self._data.qpos[:] = self._body.mujoco_q(q)
        self._data.ctrl[self._body.actuators] = self._control.target
        self._referee.reset()
        self._tick = 0
        self._kept: deque[Measured] = deque(maxlen=_KEPT)
        self._shown = 0
        self._pressure = (0.0, 0.0)
        self._sequence: dict[str, int] = {}
        self._poses.begin()
        self._disturbances.apply(-1, 0.0, (0.0, 0.0, 0.0))
        mujoco.mj_forward(self.model, self._data)
        self._measure()
        self._ready = True

    def advance(self, until_ns: int) -> Sequence[Sample]:
        """Take all whole ticks that end at or before until_ns; the samples by source stamp.

        Raises:
            TwinError: ``error``: not reset; ``nan``: the physics has diverged.
        """
        if not self._ready:
            raise TwinError("error", "the twin has not been reset since it was built, failed or was closed")
        samples: list[Sample] = []
        while (self._tick + 1) * PERIOD_NS <= until_ns:
            self._step()
            self._tick += 1
            self._measure()
            self._publish(samples)
        samples.sort(key=_by_stamp)
        return samples

    def intervene(self, intervention: Intervention) -> None:
        """Ask for an action from now on; unknown ones are ignored.

        Raises:
            BadInputError: the strength is not within 0..1.
        """
        if intervention.action not in ACTIONS:
            return
        if not 0.0 <= intervention.strength <= 1.0:
            place = f"intervention {intervention.action}"
            raise BadInputError(place, f"strength is {intervention.strength!r}", "; expected 0..1")
        if self._ready:
            self._control.ask(intervention.action, intervention.strength)

    def events(self) -> Sequence[TwinEvent]:
        """Events since reset, by time."""
        return self._referee.events()

    def probes(self) -> Mapping[str, float]:
        """Ground truth now; empty before the first reset."""
        if not self._ready:
            return {}
        data, body, referee = self._data, self._body, self._referee
        com, rate = data.subtree_com[body.base_id], self._com_rate()
        omega = self._control.gait.omega
        wrenches = self._sensors.true_wrenches(data)
        zmp = self._zmp(wrenches)
        found = {"com_x": com[0], "com_y": com[1], "com_z": com[2], "com_vx": rate[0], "com_vy": rate[1]}
        found |= {"xi_x": com[0] + rate[0] / omega, "xi_y": com[1] + rate[1] / omega, "zmp_x": zmp[0], "zmp_y": zmp[1]}
        for side, site in zip(("left", "right"), self._sensors.sole_sites, strict=True):
            place = data.site_xpos[site]
            found |= {f"foot_{side}_x": place[0], f"foot_{side}_y": place[1], f"foot_{side}_z": place[2]}
        for side, wrench in zip(("left", "right"), wrenches, strict=True):
            found[f"load_{side}"] = wrench[2]
        found |= {"tilt": self._tilt(), "error_x": self._control.error[0], "error_y": self._control.error[1]}
        found |= {"contact_force": referee.force, "contact_force_peak": referee.peak, "floor_peak": referee.floor_peak}
        found |= {"balance_lost": referee.lost, "fallen": referee.fallen, "steps": self._control.gait.steps}
        return {name: float(value) for name, value in found.items()}

    def record(self, rate_hz: float) -> None:
        """Keep poses at this rate from the next reset on; 0 keeps none."""
        self._poses = Poses(rate_hz)

    def save(self, path: Path) -> None:
        """Write the poses since the reset into a file for the pictures of this kind of twin."""
        self._poses.save(path)

    def close(self) -> None:
        """Nothing is held that the garbage collector does not free."""
        self._ready = False

    # --- one tick ----------------------------------------------------------------------------------------------------

    def _step(self) -> None:
        now_ns = self._tick * PERIOD_NS
        model, data, body, control = self.model, self._data, self._body, self._control
        disturbances = self._disturbances
        measured = self._aged(now_ns, self._p["delay"] + disturbances.lag_s)
        target, stiffness, damping = control.tick(now_ns, measured, blind=disturbances.blind)
        share, foothold = control.gait.landing
        x, y = control.frame.out(foothold.x, foothold.y)
        disturbances.apply(control.gait.swing, share, (x, y, foothold.yaw + control.frame.yaw))
        weak, left = disturbances.weak
        if left < 1.0:
            stiffness, damping = stiffness.copy(), damping.copy()  # the controller knows nothing of it
            stiffness[weak] *= left
            damping[weak] *= left
            limit = body.model.actuator_forcerange[body.actuators[weak]]
            model.actuator_forcerange[body.actuators[weak]] = left * limit
        a = body.actuators
        data.ctrl[a] = target
        model.actuator_gainprm[a, 0] = stiffness
        model.actuator_biasprm[a, 1] = -stiffness
        model.actuator_biasprm[a, 2] = -damping
        self._physics(now_ns)
        if any(data.warning[w].number for w in _DIVERGED) or not math.isfinite(
            float(data.qpos.sum() + data.qvel.sum())
        ):
            self._ready = False
            raise TwinError("nan", f"the physics has diverged at {now_ns / NS_PER_S:.3f} s")
        mujoco.mj_forward(model, data)
        com_z = float(data.subtree_com[body.base_id][2])
        self._referee.balance(now_ns + PERIOD_NS, self._tilt(), com_z, self._beyond())

    def _physics(self, now_ns: int) -> None:
        """Step by step where contacts must be seen at each; else all at once."""
        model, data, people, referee = self.model, self._data, self._people, self._referee
        people.plan(now_ns + PERIOD_NS)
        near = people.near(data.qpos[:2], _FALL_M if referee.lost else _NEAR_M)
        if not near and not referee.lost:
            people.go(1.0)
            mujoco.mj_step(model, data, _SUBSTEPS)
            self._judge_floor(now_ns + PERIOD_NS)
            return
        for k in range(_SUBSTEPS):
            people.go((k + 1.0) / _SUBSTEPS)
            mujoco.mj_step1(model, data)
            data.qfrc_applied[:] = 0.0
            at_ns = now_ns + round((k + 1) * STEP_S * NS_PER_S)
            if near:
                referee.touches(at_ns, people.push(STEP_S))
            mujoco.mj_step2(model, data)
            if referee.lost or k == _SUBSTEPS - 1:
                self._judge_floor(at_ns)
        data.qfrc_applied[:] = 0.0
        if not near:
            referee.touches(now_ns + PERIOD_NS, ())

    def _judge_floor(self, now_ns: int) -> None:
        """Sum of the normal forces of the floor on all but the soles."""
        data, soles = self._data, self._body.sole_geoms
        total, force = 0.0, np.empty(6)
        for k, (a, b) in enumerate(data.contact.geom.tolist()):
            floor, other = (a, b) if a in self._floor_geoms else (b, a)
            if floor in self._floor_geoms and other not in soles:
                mujoco.mj_contactForce(self.model, data, k, force)
                total += float(force[0])
        self._referee.floor(now_ns, total)

    def _measure(self) -> None:
        self._kept.append(self._sensors.measure(self._data, self._tick * PERIOD_NS))
        self._poses.take(self._tick * PERIOD_NS, self._data)

    def _aged(self, now_ns: int, age_s: float) -> Measured:
        """The newest measurement that is at least so old, or the first."""
        stamp = now_ns - round(age_s * NS_PER_S)
        back = max(0, -(-(now_ns - stamp) // PERIOD_NS))
        return self._kept[-1 - min(back, len(self._kept) - 1)]

    def _publish(self, samples: list[Sample]) -> None:
        """What arrives now: each measurement once, when its latency is over, and the plan of now."""
        now_ns = self._tick * PERIOD_NS
        due = (now_ns - round((self._p["latency"] + self._disturbances.lag_s) * NS_PER_S)) // PERIOD_NS
        for tick in range(self._shown + 1, due + 1):
            measured = self._kept[tick - self._tick - 1]
            for name, _, every, make in self._out.measured:
                if tick % every == 0:
                    self._send(samples, measured.stamp_ns, name, make(measured))
        self._shown = max(self._shown, due)
        for name, _, every, make_plan in self._out.planned:
            if self._tick % every == 0:
                self._send(samples, now_ns, name, make_plan())
        for stamp_ns, name, message in self._people.seen(now_ns):
            self._send(samples, stamp_ns, name, message)

    def _send(self, samples: list[Sample], stamp_ns: int, name: str, message: Any) -> None:
        number = self._sequence.get(name, 0)
        self._sequence[name] = number + 1
        samples.append(Sample(stamp_ns, f"{self._robot}/{name}", message, number, self._tick * PERIOD_NS))

    # --- truth -------------------------------------------------------------------------------------------------------

    def _tilt(self) -> float:
        return math.acos(max(-1.0, min(1.0, float(self._data.site_xmat[self._sensors.torso_site][8]))))

    def _com_rate(self) -> Any:
        mujoco.mj_subtreeVel(self.model, self._data)
        return self._data.subtree_linvel[self._body.base_id]

    def _beyond(self) -> float:
        """How far the capture point is outside the rectangle about both soles (m); below 0 inside."""
        robot, data = self._body.robot, self._data
        com, rate, omega = data.subtree_com[self._body.base_id], self._com_rate(), self._control.gait.omega
        soles = [data.site_xpos[site] for site in self._sensors.sole_sites]
        reach = (max(-robot.sole_x_min_m, robot.sole_x_max_m), robot.sole_y_half_m)
        off = -math.inf
        for i in (0, 1):
            xi = float(com[i] + rate[i] / omega)
            low, high = sorted(float(sole[i]) for sole in soles)
            off = max(off, low - reach[i] - xi, xi - high - reach[i])
        return off

    def _zmp(self, wrenches: Floats) -> tuple[float, float]:
        """Centre of pressure of both soles on the ground; the last one while none is loaded."""
        data = self._data
        load = x = y = 0.0
        for site, wrench in zip(self._sensors.sole_sites, wrenches, strict=True):
            r, p = data.site_xmat[site].reshape(3, 3), data.site_xpos[site]
            (fx, fy, fz), (tx, ty, _) = (r @ wrench[:3]).tolist(), (r @ wrench[3:]).tolist()
            px, py, pz = p.tolist()
            load, x, y = load + fz, x + px * fz - pz * fx - ty, y + py * fz - pz * fy + tx
        if load > _LOADED_N:
            self._pressure = float(x / load), float(y / load)
        return self._pressure


def _by_stamp(sample: Sample) -> int:
    return sample.stamp_ns
