"""Test bench of the balance plant: its C compiled with the product's builder and driven in process.

Run as a script it prints who is saved by which action after which precursor: ``python tests/fmus/balance_bench.py 50``.
"""

from __future__ import annotations

import ctypes
import sys
import tempfile
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path

import numpy as np
import numpy.typing as npt

import foreshock_fmus
from foreshock_fmus._c_source import variables_header
from foreshock_fmus._compiler import compile_library, find_compiler
from foreshock_fmus._description import read_plant

Array = npt.NDArray[np.float64]
HERE = Path(__file__).parent
FOLDER = Path(foreshock_fmus.__file__).parent / "plants" / "balance"
EVENTS = ("slip", "torso", "com", "tip", "contact", "fallen", "peak", "max_slip", "max_rate", "max_deviation", "acted")
ACTS = ("step", "lock", "arms", "compliance", "mitigation")
QUIET = dict.fromkeys(("dcm_noise", "footfall_push"), 0.0)
NOISELESS = dict.fromkeys(
    (
        "encoder_noise", "joint_rate_noise", "base_noise", "base_rate_noise", "attitude_noise", "gyro_noise",
        "accelerometer_noise", "force_noise", "torque_noise", "human_noise", "latency",
    ),
    0.0,
)  # fmt: skip


class Bench:
    """One instance of the plant."""

    def __init__(self) -> None:
        self.plant = read_plant(FOLDER / "balance.toml")
        self.index: dict[str, slice] = {}
        starts: list[float] = []
        for v in self.plant.variables:
            self.index[v.name] = slice(len(starts), len(starts) + v.size)
            starts += list(v.start) if v.start else [0.0] * v.size
        at = self.index["base_position"].start
        self.index["q"], self.index["v"] = slice(at, at + 39), slice(at + 39, at + 77)
        self.start = np.array(starts)
        self.lib = self._compile()
        self.lib.bench_size.restype = ctypes.c_size_t
        self.lib.bench_run.restype = ctypes.c_long
        self.lib.bench_message.restype = ctypes.c_char_p
        self.state = ctypes.create_string_buffer(self.lib.bench_size())
        self.vars = self.start.copy()

    def _compile(self) -> ctypes.CDLL:
        with tempfile.TemporaryDirectory() as scratch:
            (Path(scratch) / "plant_vars.h").write_text(variables_header(self.plant))
            out = Path(scratch) / "bench.so"
            sources = [*sorted(FOLDER.glob("*.c")), HERE / "balance_batch.c"]
            compile_library(
                find_compiler(),
                sources,
                [Path(scratch), FOLDER.parents[1] / "adapter", FOLDER.parents[1] / "common"],
                {},
                out,
            )
            return ctypes.CDLL(str(out))

    def _pointer(self, array: Array) -> ctypes.c_void_p:
        return ctypes.c_void_p(array.ctypes.data)

    def init(self, parameters: Mapping[str, float] = {}) -> None:
        """Back to time 0."""
        self.vars[:] = self.start
        for name, value in parameters.items():
            self.vars[self.index[name]] = value
        code = self.lib.bench_init(self.state, self._pointer(self.vars))
        assert code == 0, self.lib.bench_message(self.state)

    def step(self, t: float, h: float = 0.005) -> int:
        """plant_step; its code."""
        return int(self.lib.bench_step(self.state, self._pointer(self.vars), ctypes.c_double(t), ctypes.c_double(h)))

    def __getitem__(self, name: str) -> Array:
        return self.vars[self.index[name]]

    def run(
        self,
        parameters: Mapping[str, float] = {},
        t_end: float = 8.0,
        watch: Sequence[str] = (),
        trigger: int = 0,
        delay: float = 0.05,
        acts: Sequence[str] = (),
        h: float = 0.001,
    ) -> tuple[dict[str, float], dict[str, Array]]:
        """Event times, and a log of the watched variables after every step.

        trigger: precursor 1..3 (slip, torso, CoM) whose onset plus delay switches on acts; 4 at the time delay;
            0 never.
        """
        self.vars[:] = self.start
        for name, value in parameters.items():
            self.vars[self.index[name]] = value
        slices = {name: self.index[name] for name in watch}
        flat = np.array([i for s in slices.values() for i in range(s.start, s.stop)], dtype=np.int32)
        n = round(t_end / h)
        log, events = np.zeros((n, max(len(flat), 1))), np.zeros(len(EVENTS))
        on = np.array([1.0 if a in acts else 0.0 for a in ACTS])
        taken = self.lib.bench_run(
            self.state, self._pointer(self.vars), ctypes.c_double(t_end), ctypes.c_double(h),
            trigger, ctypes.c_double(delay), self._pointer(on), len(flat), ctypes.c_void_p(flat.ctypes.data),
            self._pointer(log), self._pointer(events),
        )  # fmt: skip
        assert taken == n, self.lib.bench_message(self.state)
        logs, at = {"t": (np.arange(n) + 1) * h}, 0
        for name, s in slices.items():
            size = s.stop - s.start
            logs[name] = log[:, at] if size == 1 else log[:, at : at + size]
            at += size
        return dict(zip(EVENTS, events.tolist(), strict=True)), logs


@cache
def bench() -> Bench:
    """The one compiled bench of this process."""
    return Bench()


def _table(n: int) -> str:
    """Falls without action, and robots saved by acting 50 ms after each precursor, of n seeds."""

    def falls(trigger: int, acts: tuple[str, ...]) -> list[dict[str, float]]:
        runs = [
            bench().run({"seed": s, "sensor_period": 0.1}, 10.0, h=0.005, trigger=trigger, acts=acts)[0]
            for s in range(1, n + 1)
        ]
        return [r for r in runs if np.isfinite(r["tip"])]

    def row(acts: tuple[str, ...]) -> str:
        return f"  {' + '.join(acts):38}" + "".join(f"{n - len(falls(k, acts)):5d}" for k in (1, 2, 3))

    def spread(name: str) -> str:
        return f"  {name:8}" + "".join(
            f"{x:7.2f}" for x in np.percentile([r[name] - r["slip"] for r in alone], (10, 50, 90))
        )

    alone = falls(0, ())
    every = [("step",), ("lock",), ("arms",), ("compliance",), ("step", "lock"), ("step", "lock", "arms", "compliance")]
    lines = [
        f"without action {len(alone)} of {n} fall; s after the slip, 10/50/90%:",
        *map(spread, ("torso", "com", "tip", "contact")),
        "saved by acting 50 ms after precursor      1    2    3",
        *map(row, every),
    ]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    sys.stdout.write(_table(int(sys.argv[1]) if len(sys.argv) > 1 else 50))
