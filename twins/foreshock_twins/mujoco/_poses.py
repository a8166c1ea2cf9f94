"""What moved in a run, for pictures: kept while it runs, written to a file, and read again."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from numpy.typing import NDArray

from foreshock.clock import NS_PER_S, seconds
from foreshock.errors import BadInputError

__all__ = ["Poses", "Recording", "load"]

Array = NDArray[np.float64]


class Recording(msgspec.Struct, frozen=True):
    """What moved in a run; n times.

    Attributes:
        times_s: shape (n,), increasing.
        qpos: shape (n, nq).
        mocap_pos: shape (n, bodies, 3).
        mocap_quat: shape (n, bodies, 4), w x y z.
    """

    times_s: Array
    qpos: Array
    mocap_pos: Array
    mocap_quat: Array

    def at(self, time_s: float) -> int:
        """Row of the newest sample at a time; the first one before there is any, the last one ever after."""
        return max(int(np.searchsorted(self.times_s, time_s + 1e-9, side="right")) - 1, 0)


class Poses:
    """Keeps poses at a rate; 0 keeps none."""

    def __init__(self, rate_hz: float = 0.0) -> None:
        self._period_ns = round(NS_PER_S / rate_hz) if rate_hz > 0.0 else 0
        self.begin()

    def begin(self) -> None:
        """Forget what was kept."""
        self._rows: list[tuple[float, Array, Array, Array]] = []
        self._due_ns = 0

    def take(self, now_ns: int, data: Any) -> None:
        """Keep the pose of a MjData, if it is time."""
        if self._period_ns and now_ns >= self._due_ns:
            self._due_ns += self._period_ns
            self._rows.append((seconds(now_ns), data.qpos.copy(), data.mocap_pos.copy(), data.mocap_quat.copy()))

    def save(self, path: Path) -> None:
        """Write what was kept as NPZ.

        Raises:
            BadInputError: nothing was kept.
        """
        if not self._rows:
            raise BadInputError(str(path), "no poses were kept", "; ask for them before the reset")
        times, qpos, pos, quat = (np.array(column) for column in zip(*self._rows, strict=True))
        with path.open("wb") as file:
            np.savez(file, times_s=times, qpos=qpos, mocap_pos=pos, mocap_quat=quat)


def load(path: Path) -> Recording:
    """What save has written.

    Raises:
        BadInputError: it is no such file.
    """
    try:
        with np.load(path, allow_pickle=False) as found:
            return Recording(**{name: found[name] for name in Recording.__struct_fields__})
    except (ValueError, KeyError, EOFError) as e:
        raise BadInputError(str(path), f"is not a file of poses: {e}") from e
