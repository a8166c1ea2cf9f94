"""A plugin whose packages are not installed."""

import msgspec
from tests.rogues.plugins.rogue_detectors import Settings, Upright, spec_of

from foreshock.hookspecs import hookimpl


def _build(settings: Settings) -> Upright:
    import thermal_camera_driver  # noqa: F401 # type: ignore[import-not-found] # nobody has it

    return Upright(settings)


@hookimpl
def foreshock_detectors():
    return (msgspec.structs.replace(spec_of(Upright), id="needs-extra", build=_build, extra="thermal-camera-driver"),)
