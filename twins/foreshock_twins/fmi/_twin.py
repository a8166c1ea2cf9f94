"""The twin port over an FMU instance."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Protocol

from foreshock.clock import NS_PER_S
from foreshock.errors import BadInputError, ConfigError, TwinError, nearest
from foreshock.records import Intervention, Sample
from foreshock.twin import Channel, Parameters, TwinEvent
from foreshock_twins.fmi._binding import Binding, InputTarget
from foreshock_twins.fmi._layout import Layout, Reader, Values
from foreshock_twins.fmi._log import FmuLog
from foreshock_twins.fmi._referee import Referee
from foreshock_twins.fmi._variables import Variable, Variables

__all__ = ["FmuTwin", "Stepper"]

# Seeds are reduced to what the parameter's type can hold exactly.
_SEED_MODULUS = {"Real": 2**53, "Float64": 2**53, "Float32": 2**24}


class Stepper(Protocol):
    """What runs behind the twin: one FMU, or several that are connected."""

    def reset(self) -> None:
        """Back to the state after instantiation."""

    def initialize(self, values: Mapping[Variable, float]) -> None:
        """Set parameters and start values, then initialize at time 0."""

    def set(self, values: Mapping[Variable, float], t: float = 0.0) -> None:
        """Set inputs at time t (s)."""

    def step(self, t: float, h: float) -> Values:
        """Advance from t by h (s), and read."""

    def read(self, t: float) -> Values:
        """All bound values at time t (s)."""

    def close(self) -> None:
        """Free everything; idempotent."""


class FmuTwin:
    """A stepped twin: an FMU seen through its binding. Call reset first.

    Args:
        robot: prefix of the channels.
        variables: the FMU's variables.
        binding: what they mean.
        layout: the order of the values that a step yields.
        instance: the FMU.
        log: what it says.
    """

    def __init__(
        self, robot: str, variables: Variables, binding: Binding, layout: Layout, instance: Stepper, log: FmuLog
    ) -> None:
        self._variables, self._binding, self._instance, self._log = variables, binding, instance, log
        self._channels = tuple(Channel(c.name, c.type, c.every * binding.step_ns) for c in binding.channels)
        self._actions = frozenset(binding.actions)
        self._makers: list[tuple[int, str, Reader, Reader | None]] = [
            (c.every, f"{robot}/{c.name}", c.message.reader(layout), layout.number(c.stamp) if c.stamp else None)
            for c in binding.channels
        ]
        self._sort = any(c.stamp for c in binding.channels)
        self._probes = {name: layout.number(v) for name, v in binding.probes.items()}
        self._referee = Referee(binding.events, layout)
        self._strengths: dict[str, float] = {}
        self._inputs: dict[Variable, float] = {}
        self._sequence = [0] * len(self._makers)
        self._step = 0
        self._values: Values = ()
        self._ready = False

    @property
    def channels(self) -> Sequence[Channel]:
        """What it streams."""
        return self._channels

    @property
    def period_ns(self) -> int:
        """Communication step of the binding."""
        return self._binding.step_ns

    @property
    def stepped(self) -> bool:
        """True: time passes in advance() alone."""
        return True

    @property
    def actions(self) -> frozenset[str]:
        """The actions of the binding."""
        return self._actions

    def reset(self, parameters: Parameters, seed: int) -> None:
        """Back to time 0. The seed goes to the binding's seed parameter, modulo what its type can hold.

        Raises:
            ConfigError: an unknown parameter, or a value outside its range.
            TwinError: the FMU does not initialize.
        """
        values = {self._parameter(name): value for name, value in parameters.items()}
        for variable, value in values.items():
            if not math.isfinite(value) or not variable.min <= value <= variable.max:
                problem = f"{variable.name!r} = {value!r} is out of range"
                raise ConfigError("parameters", problem, f"; [{variable.min!r}, {variable.max!r}], finite")
        if self._binding.seed is not None:
            values[self._binding.seed] = float(seed % _SEED_MODULUS.get(self._binding.seed.type, 2**31))
        self._ready = False
        self._log.clear()
        self._strengths, self._inputs = {}, {}
        self._sequence, self._step = [0] * len(self._makers), 0
        self._referee.reset()
        self._instance.reset()
        self._instance.initialize(values)
        self._values = self._instance.read(0.0)
        self._ready = True

    def advance(self, until_ns: int) -> Sequence[Sample]:
        """Take all whole steps that end at or before until_ns; the samples by source stamp.

        Raises:
            TwinError: ``error``, ``discard`` or ``nan``; then only reset and close are allowed.
        """
        if not self._ready:
            detail = "the twin has not been reset since it was built, failed or was closed"
            raise TwinError("error", detail, self._log.text())
        step_ns, n = self._binding.step_ns, self._step
        h = step_ns / NS_PER_S
        samples: list[Sample] = []
        try:
            while (n + 1) * step_ns <= until_ns:
                self._values = values = self._instance.step(n * step_ns / NS_PER_S, h)
                n += 1
                now_ns = n * step_ns
                self._referee.see(values, now_ns)
                for i, (every, channel, make, stamp) in enumerate(self._makers):
                    if n % every == 0:
                        at = now_ns if stamp is None else round(stamp(values) * NS_PER_S)
                        samples.append(Sample(at, channel, make(values), self._sequence[i], now_ns))
                        self._sequence[i] += 1
        except TwinError:
            self._ready = False
            raise
        self._step = n
        if self._sort:
            samples.sort(key=_by_stamp)
        return samples

    def intervene(self, intervention: Intervention) -> None:
        """Set the inputs of an action, linear in its strength; unknown actions are ignored.

        Of several actions on one input, the one that takes it farthest from its start value wins.

        Raises:
            BadInputError: the strength is not within 0..1.
            TwinError: the FMU refuses the value.
        """
        if intervention.action not in self._binding.actions:
            return
        if not 0.0 <= intervention.strength <= 1.0:
            place = f"intervention {intervention.action}"
            raise BadInputError(place, f"strength is {intervention.strength!r}", "; expected 0..1")
        self._strengths[intervention.action] = intervention.strength
        wanted = self._wanted()
        changed = {v: value for v, value in wanted.items() if self._inputs.get(v) != value}
        if changed and self._ready:
            self._instance.set(changed, self._step * self._binding.step_ns / NS_PER_S)
            self._inputs.update(changed)

    def events(self) -> Sequence[TwinEvent]:
        """Events since reset, by time."""
        return self._referee.events()

    def probes(self) -> Mapping[str, float]:
        """Ground truth at the last step; empty before the first reset."""
        return {name: read(self._values) for name, read in self._probes.items()} if self._values else {}

    def close(self) -> None:
        """Free the instance; idempotent."""
        self._ready = False
        self._instance.close()

    def _parameter(self, name: str) -> Variable:
        settable = [v.name for v in self._variables.values() if v.causality == "parameter"]
        if name not in settable:
            raise ConfigError("parameters", f"{self._variables.fmu} has no parameter {name!r}", nearest(name, settable))
        if self._binding.seed is not None and name == self._binding.seed.name:
            raise ConfigError("parameters", f"{name!r} is set by the seed", "; give the run another seed")
        return self._variables.find(name, "parameters")

    def _wanted(self) -> dict[Variable, float]:
        """The value of every input that an action has touched since reset."""
        wanted: dict[Variable, tuple[float, float]] = {}
        for action, strength in self._strengths.items():
            for t in self._binding.actions[action]:
                value = _value(t, strength)
                distance = abs(value - t.start)
                if t.variable not in wanted or distance > wanted[t.variable][0]:
                    wanted[t.variable] = (distance, value)
        return {variable: value for variable, (_, value) in wanted.items()}


def _value(t: InputTarget, strength: float) -> float:
    # Exact at both ends, which start + strength * (target - start) is not.
    return t.target if strength == 1.0 else t.start + strength * (t.target - t.start)


def _by_stamp(sample: Sample) -> int:
    return sample.stamp_ns
