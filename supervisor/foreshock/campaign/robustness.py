"""How near a run came to what must not happen: the robustness of an STL formula over the plant's probes, by RTAMT."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from foreshock.errors import ConfigError, nearest
from foreshock.stl import WORDS, specification

__all__ = ["Robustness"]

NAME = re.compile(r"(?<![\w.])[A-Za-z_$][\w$./]*")
"""A signal as RTAMT reads it: a slash belongs to a name that it follows."""


class Robustness:
    """rho(formula, run) at time 0: above 0 the formula holds, and by how much; below 0 it is violated.

    Args:
        formula: e.g. ``always(contact_force_peak <= 280)``; its signals are the plant's probes.
        step_s: sampling step, the period of the supervisor.

    Raises:
        ConfigError: RTAMT refuses the formula, or it names no signal.
        MissingExtraError: RTAMT is not installed.
    """

    def __init__(self, formula: str, step_s: float) -> None:
        self.formula, self._step_s = formula, step_s
        self._names = tuple(n for n in dict.fromkeys(NAME.findall(formula)) if n not in WORDS)
        if not self._names:
            raise ConfigError("formula", f"{formula!r} names no probe of the plant")
        self._evaluate = specification(formula, self._names, step_s).evaluate

    def of(self, series: Mapping[str, Sequence[float]]) -> float:
        """Of a run's series, whose columns ``true:<probe>`` are the probes.

        Raises:
            ConfigError: the formula names what is no probe.
        """
        data: dict[str, Sequence[float]] = {"time": [k * self._step_s for k in range(len(series["t_s"]))]}
        for name in self._names:
            if f"true:{name}" not in series:
                known = [k.removeprefix("true:") for k in series if k.startswith("true:")]
                spaces = "; put spaces around a slash that divides" if "/" in name else ""
                hint = (nearest(name, known) or f"; expected one of {', '.join(sorted(known))}") + spaces
                raise ConfigError("formula", f"{name!r} is no probe of the plant", hint)
            data[name] = series[f"true:{name}"]
        return float(self._evaluate(data)[0][1])
