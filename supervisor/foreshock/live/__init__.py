"""A supervisor that runs beside a robot, over Zenoh (docs/live.md)."""

from foreshock.live._config import RunConfig, load_run, parse_run
from foreshock.live._denied import Denied, DeniedPeers, Refused, watch_log
from foreshock.live._run import LiveSupervisor
from foreshock.live._security import access_rules, init_security
from foreshock.live._serve import FreeRunning, SteppedServer
from foreshock.live._services import ResetRequest
from foreshock.live._settings import JournalSettings, LiveSettings
from foreshock.live._status import Status
from foreshock.live._stream import StreamCounts

__all__ = [
    "Denied",
    "DeniedPeers",
    "FreeRunning",
    "JournalSettings",
    "LiveSettings",
    "LiveSupervisor",
    "Refused",
    "ResetRequest",
    "RunConfig",
    "Status",
    "SteppedServer",
    "StreamCounts",
    "access_rules",
    "init_security",
    "load_run",
    "parse_run",
    "watch_log",
]
