"""Detectors that raise, as a scenario's faults demand."""

from __future__ import annotations

from collections.abc import Sequence

from foreshock.errors import ConfigError, nearest
from foreshock.session._fault_streams import happens, stream_names
from foreshock.session.faults import Crash, Fault

__all__ = ["Crashes"]


class Crashes:
    """Detectors that raise: given to a supervisor as verdicts, which a journal keeps, so that a replay raises too.

    Args:
        faults: of the scenario; those that are no crash are passed over.
        detectors: ids of those that run.
        seed: of the run.
        place: where the faults stand, for messages.

    Raises:
        ConfigError: no such detector runs.
    """

    def __init__(self, faults: Sequence[Fault], detectors: Sequence[str], seed: int, place: str) -> None:
        self._crashes: list[Crash] = []
        for k, (fault, name) in enumerate(zip(faults, stream_names(faults), strict=True)):
            if not isinstance(fault, Crash):
                continue
            if fault.detector not in detectors:
                hint = nearest(fault.detector, detectors)
                raise ConfigError(f"{place}: faults[{k}].detector", f"no detector {fault.detector!r} runs", hint)
            if happens(fault, seed, name):
                self._crashes.append(fault)

    def at(self, now_ns: int) -> dict[str, str]:
        """Verdict per detector that raises in this tick."""
        return {c.detector: f"raised: fault injected at {c.from_s:g} s" for c in self._crashes if c.holds(now_ns)}
