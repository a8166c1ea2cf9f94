"""Which risk model a supervisor runs, and with what."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

import msgspec

from foreshock._strict import within
from foreshock.errors import ConfigError
from foreshock.risk._correlated import CorrelatedRisk
from foreshock.risk._estimator import RiskModel
from foreshock.risk._independent import IndependentRisk
from foreshock.risk._le import LogisticExponential
from foreshock.risk._parameters import RiskParameters, load_parameters
from foreshock.taxonomy import Taxonomy

__all__ = ["RiskSettings"]


class RiskSettings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The risk model.

    Attributes:
        model: ``independent`` is Eq. 1 on plain counts; ``correlated`` its extension to correlated precursors.
        parameters: of the correlated model: a file made by ``foreshock calibrate``, or the shipped ``table-3``.
        a: gain, instead of the paper's 1.6 or of what the parameter file says.
        b: half-way number of kinds, likewise (2).
        c: saturation of recurrence, likewise (1.2).
        kappa: weight of the cascade lift, instead of the parameter file's.
        presence: strength of a precursor of severity 0, likewise.

    Raises:
        ConfigError: a number out of its range, or a setting that the model does not have.
    """

    model: Literal["independent", "correlated"] = "independent"
    parameters: str = ""
    a: float | None = None
    b: float | None = None
    c: float | None = None
    kappa: float | None = None
    presence: float | None = None

    def __post_init__(self) -> None:
        LogisticExponential(**self._given("a", "b", "c"))
        if self.model == "independent":
            for name in ("parameters", "kappa", "presence"):
                if getattr(self, name) not in (None, ""):
                    raise ConfigError(f"risk.{name}", 'only model = "correlated" has it')
        if self.kappa is not None:
            within("risk.kappa", self.kappa, 0.0)
        if self.presence is not None:
            within("risk.presence", self.presence, 0.0, 1.0)

    def _given(self, *names: str) -> dict[str, float]:
        return {name: value for name in names if (value := getattr(self, name)) is not None}

    def loaded(self, base: Path, taxonomy: Taxonomy) -> RiskParameters:
        """The parameters of the correlated model, with what these settings change.

        Args:
            base: folder that a relative path starts from.
            taxonomy: that the kinds belong to.

        Raises:
            ConfigError: the file cannot be read or does not fit.
        """
        parameters = load_parameters(self.parameters or "table-3", base, taxonomy)
        return msgspec.structs.replace(parameters, **self._given("a", "b", "c", "kappa", "presence"))

    def build(self, base: Path, taxonomy: Taxonomy, window_s: float) -> RiskModel:
        """The model.

        Args:
            base: folder that a relative path starts from.
            taxonomy: kinds, classes and modes.
            window_s: length of the evidence window; calibrated parameters hold for theirs only.

        Raises:
            ConfigError: the parameter file cannot be read, does not fit, or was calibrated for another window.
        """
        if self.model == "independent":
            return IndependentRisk(LogisticExponential(**self._given("a", "b", "c")), taxonomy)
        parameters = self.loaded(base, taxonomy)
        if parameters.horizon_s > 0.0 and abs(parameters.window_s - window_s) > 1e-9:
            problem = f"{window_s!r} s, but the parameters {parameters.name!r} were calibrated for another window"
            raise ConfigError("window.length_s", problem, f"; set it to {parameters.window_s!r}")
        return CorrelatedRisk(parameters, taxonomy)
