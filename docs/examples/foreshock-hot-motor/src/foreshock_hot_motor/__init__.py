"""Joint motors that run into their thermal limit, by the thermal replica of IEC 60255-149."""

from __future__ import annotations

import math
from collections.abc import Sequence

import msgspec

from foreshock.detector import Detector, DetectorSpec, Input
from foreshock.errors import ConfigError
from foreshock.hookspecs import hookimpl
from foreshock.messages import JointState
from foreshock.taxonomy import PrecursorKind

__all__ = ["KIND", "SPEC", "Settings", "foreshock_detectors", "foreshock_precursors"]

KIND = PrecursorKind(
    id="motor-overload",
    title="Motor thermal overload",
    class_="system-telemetry",
    source="IEC 60255-149 (thermal electrical relays); class by failure origin: a tripped drive is mode A9",
    aliases=("hot-motor",),
)


class Settings(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Settings of the thermal replica.

    Attributes:
        rated_n_m: torque that the motor can give continuously, by joint (N m), from its data sheet. The default is a
            quarter of the URDF's peak torque of TALOS's knees (300 N m), since servo motors peak at 3 to 5 times rated.
        time_constant_s: thermal time constant of the motor (s), from its data sheet; 5 min is a frame of 1 kW.
        start: thermal level assumed at reset, when nothing is known of the past; 0.5 is a motor at 70 % torque so far.
        limit: thermal level from which the motor is overloaded; drives warn at 80 to 90 %.
        release: absent again below this share of the limit.
    """

    rated_n_m: dict[str, float] = msgspec.field(
        default_factory=lambda: {"leg_left_4_joint": 75.0, "leg_right_4_joint": 75.0}
    )
    time_constant_s: float = 300.0
    start: float = 0.5
    limit: float = 0.85
    release: float = 0.95

    def __post_init__(self) -> None:
        """Refuse what makes no sense, with the place and the value."""
        if not self.rated_n_m:
            raise ConfigError("rated_n_m", "names no joint")
        for joint, rated in self.rated_n_m.items():
            if not 0.0 < rated < math.inf:
                raise ConfigError(f"rated_n_m.{joint}", f"{rated} is not a torque in N m")
        if not 0.0 < self.time_constant_s < math.inf:
            raise ConfigError("time_constant_s", f"{self.time_constant_s} is not a time in s")
        if not 0.0 <= self.start <= 1.0:
            raise ConfigError("start", f"{self.start} is not within 0..1")
        if not 0.0 < self.limit < 1.0:
            raise ConfigError("limit", f"{self.limit} is not between 0 and 1, where the motor trips")
        if not 0.0 < self.release <= 1.0:
            raise ConfigError("release", f"{self.release} is not a share of the limit")


def _build(settings: Settings) -> Detector:
    from foreshock_hot_motor._detector import HotMotorDetector

    return HotMotorDetector(settings)


SPEC = DetectorSpec(
    id="hot-motor",
    kinds=(KIND.id,),
    inputs=(Input("joints", "joints/state", JointState, max_age_s=0.1, min_rate_hz=20.0),),
    build=_build,
    config=Settings,
    deadline_s=0.001,
    summary="joint motors near their thermal limit, from torque by the thermal replica of IEC 60255-149",
)


@hookimpl
def foreshock_detectors() -> Sequence[DetectorSpec]:
    """The detector that this plugin offers."""
    return (SPEC,)


@hookimpl
def foreshock_precursors() -> Sequence[PrecursorKind]:
    """The kind that this plugin adds to the taxonomy."""
    return (KIND,)
