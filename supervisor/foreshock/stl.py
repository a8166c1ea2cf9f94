"""Formulas of signal temporal logic, by RTAMT: which words are no signals, and a specification that evaluates one."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any

from foreshock.errors import ConfigError, MissingExtraError

__all__ = ["WORDS", "specification"]

# fmt: off
WORDS = frozenset({
    "always", "eventually", "once", "historically", "until", "since", "unless", "not", "and", "or", "xor", "implies",
    "iff", "rise", "fall", "next", "prev", "true", "false", "abs", "sqrt", "exp", "pow", "log", "s", "ms", "us", "ns",
    "G", "F", "H", "O", "U", "S", "X", "Y",
})
# fmt: on
"""Words of RTAMT's formulas that are no signals."""


def specification(formula: str, names: Sequence[str], step_s: float, place: str = "formula", who: str = "") -> Any:
    """RTAMT's specification of a formula over signals of these names, sampled every step_s (s).

    Its ``evaluate`` takes ``{"time": [...], name: [...]}`` and gives (time, robustness) for every sample.

    Args:
        formula: what must hold.
        names: its signals.
        step_s: sampling step.
        place: where the need for RTAMT comes from, for the message.
        who: what needs it, for the message.

    Raises:
        ConfigError: RTAMT refuses the formula.
        MissingExtraError: RTAMT is not installed.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", DeprecationWarning)  # its parser imports typing.io
            import rtamt
    except ImportError as e:
        problem = f"{who} needs rtamt, which cannot be imported: {e}".lstrip()
        raise MissingExtraError(place, problem, "; run: pip install 'foreshock[campaign]' (Python < 3.13)") from e
    spec: Any = rtamt.StlDiscreteTimeSpecification()
    try:
        spec.set_sampling_period(round(step_s * 1e6), "us", 0.1)
        spec.unit = "s"
        for name in names:
            spec.declare_var(name, "float")
        spec.spec = formula
        spec.parse()
    except rtamt.RTAMTException as e:
        raise ConfigError("formula", f"RTAMT refuses {formula!r}: {e}") from e
    return spec
