"""Measures what faults do to supervised runs, for faults.md: python docs/results/faults.py [effect] [freeze].

``effect``: each fault on three modes, paired by seed. ``freeze``: every channel of all twelve modes frozen alone.
"""

from __future__ import annotations

import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

import msgspec

from foreshock.detector import DetectorSpec
from foreshock.hookspecs import hookimpl
from foreshock.records import Decision
from foreshock.registry import Registry
from foreshock.session.faults import parse_faults
from foreshock.session.isolated import build_twin
from foreshock.session.run import Run
from foreshock.session.scenario import Scenario, scenario_ids
from foreshock.session.simulate import simulate
from foreshock.supervisor import Supervisor
from foreshock.twin import Twin

FROM_S = 1.0
SEEDS = range(20000, 20020)
REGISTRY = Registry()
SCENARIOS = scenario_ids(REGISTRY)
FAULTS: dict[str, list[tuple[str, str, dict[str, Any]]]] = {
    "a1-fall-onto-human": [
        ("dropout of the IMU", "balance", {"kind": "dropout", "channel": "imu/torso"}),
        ("NaN from the IMU", "balance", {"kind": "nan", "channel": "imu/torso"}),
        ("IMU frozen", "balance", {"kind": "freeze", "channel": "imu/torso"}),
        ("odometry frozen", "balance proximity", {"kind": "freeze", "channel": "base/odometry"}),
        ("joints frozen", "balance proximity", {"kind": "freeze", "channel": "joints/state"}),
        ("everything frozen", "balance proximity", {"kind": "freeze", "channel": "*"}),
        ("loss of 5 % of all messages", "", {"kind": "loss", "channel": "*", "probability": 0.05}),
        ("loss of 50 % of all messages", "", {"kind": "loss", "channel": "*", "probability": 0.5}),
        ("IMU 30 ms late", "", {"kind": "delay", "channel": "imu/torso", "magnitude": 0.03}),
        ("all 60 ms late", "", {"kind": "delay", "channel": "*", "magnitude": 0.06}),
        ("all 300 ms late", "balance proximity", {"kind": "delay", "channel": "*", "magnitude": 0.3}),
        ("roll rate biased by 0.2 rad/s", "", {"kind": "bias", "channel": "imu/torso",
            "fields": ["angular_velocity[0]"], "magnitude": 0.2, "unit": "rad/s"}),
        ("roll rate noisy, 0.3 rad/s", "", {"kind": "noise", "channel": "imu/torso",
            "fields": ["angular_velocity[0]"], "magnitude": 0.3, "unit": "rad/s"}),
        ("balance crashes", "balance", {"kind": "crash", "detector": "balance"}),
        ("actions 100 ms late", "", {"kind": "late", "magnitude": 0.1}),
        ("actions 300 ms late", "", {"kind": "late", "magnitude": 0.3}),
        ("step suppression ignored", "", {"kind": "ignored", "actions": ["step-suppression"]}),
        ("balance lock ignored", "", {"kind": "ignored", "actions": ["balance-lock"]}),
        ("all actions ignored", "", {"kind": "ignored"}),
    ],
    "a5-dropped-object": [
        ("dropout of the grip", "grip", {"kind": "dropout", "channel": "left_gripper/state"}),
        ("NaN from the grip", "grip", {"kind": "nan", "channel": "left_gripper/state"}),
        ("grip frozen", "grip", {"kind": "freeze", "channel": "left_gripper/state"}),
        ("wrist frozen", "load", {"kind": "freeze", "channel": "left_wrist/wrench"}),
        ("everything frozen", "grip load", {"kind": "freeze", "channel": "*"}),
        ("loss of 50 % of all messages", "", {"kind": "loss", "channel": "*", "probability": 0.5}),
        ("all 60 ms late", "", {"kind": "delay", "channel": "*", "magnitude": 0.06}),
        ("all 300 ms late", "grip load", {"kind": "delay", "channel": "*", "magnitude": 0.3}),
        ("tangential force biased by -3 N", "", {"kind": "bias", "channel": "left_gripper/state",
            "fields": ["tangential_force"], "magnitude": -3.0, "unit": "N"}),
        ("tangential force noisy, 2 N", "", {"kind": "noise", "channel": "left_gripper/state",
            "fields": ["tangential_force"], "magnitude": 2.0, "unit": "N"}),
        ("grip crashes", "grip", {"kind": "crash", "detector": "grip"}),
        ("actions 300 ms late", "", {"kind": "late", "magnitude": 0.3}),
        ("regrasp ignored", "", {"kind": "ignored", "actions": ["regrasp"]}),
        ("all actions ignored", "", {"kind": "ignored"}),
    ],
    "a6-navigation-conflict": [
        ("dropout of the humans", "navigation vision", {"kind": "dropout", "channel": "humans/pose"}),
        ("NaN from the humans", "navigation vision", {"kind": "nan", "channel": "humans/pose"}),
        ("humans frozen", "navigation vision", {"kind": "freeze", "channel": "humans/pose"}),
        ("odometry frozen", "navigation vision", {"kind": "freeze", "channel": "base/odometry"}),
        ("everything frozen", "navigation vision", {"kind": "freeze", "channel": "*"}),
        ("loss of 50 % of all messages", "", {"kind": "loss", "channel": "*", "probability": 0.5}),
        ("all 60 ms late", "", {"kind": "delay", "channel": "*", "magnitude": 0.06}),
        ("all 1 s late", "navigation vision", {"kind": "delay", "channel": "*", "magnitude": 1.0}),
        ("humans biased by 1 m to the side", "", {"kind": "bias", "channel": "humans/pose",
            "fields": ["humans.capsules.a[1]", "humans.capsules.b[1]"], "magnitude": 1.0, "unit": "m"}),
        ("humans noisy, 0.2 m", "", {"kind": "noise", "channel": "humans/pose",
            "fields": ["humans.capsules.a", "humans.capsules.b"], "magnitude": 0.2, "unit": "m"}),
        ("navigation crashes", "navigation", {"kind": "crash", "detector": "navigation"}),
        ("actions 300 ms late", "", {"kind": "late", "magnitude": 0.3}),
        ("protective stop ignored", "", {"kind": "ignored", "actions": ["protective-stop"]}),
        ("all actions ignored", "", {"kind": "ignored"}),
    ],
}  # fmt: skip


class Notes:
    """A journal that keeps what was noticed after FROM_S, and both control-level trusts of every tick."""

    def __init__(self, mode: str) -> None:
        self._mode = mode
        self.health: dict[str, float] = {}
        self.kinds: dict[str, float] = {}
        self.trust: list[tuple[float, float]] = []

    def tick(self, samples: object, decision: Decision, verdicts: object) -> None:  # noqa: ARG002 # the port's
        """Take one tick."""
        t = decision.now_ns / 1e9
        self.trust.append((decision.trust.control_trust, decision.trust.control_by_mode[self._mode]))
        if t < FROM_S:
            return
        for h in decision.health:
            if h.state in ("unobserved", "failed", "stale", "late"):
                self.health.setdefault(h.source, t)
        for p in decision.precursors:
            self.kinds.setdefault(f"{p.detector}: {p.kind}", t)


class Absent:
    """Says from FROM_S on that there is nothing, of whatever it would have judged."""

    def __init__(self, inner: Any) -> None:
        self._inner = inner

    def reset(self, seed: int) -> None:
        """As the detector."""
        self._inner.reset(seed)

    def update(self, now_ns: int, inputs: Any) -> Sequence[Any]:
        """What it says, or that it is absent."""
        said = self._inner.update(now_ns, inputs)
        if now_ns / 1e9 < FROM_S:
            return said
        return [msgspec.structs.replace(i, present=False, severity=0.0, time_to_event_s=None) for i in said]


def honest(names: Sequence[str]) -> Registry:
    """The registry in which these detectors report absence from FROM_S on."""
    modules = {}
    for name in names:
        spec: DetectorSpec = REGISTRY.detector(name, "detectors")
        changed = msgspec.structs.replace(
            spec, isolation="in-process", build=lambda c, build=spec.build: Absent(build(c))
        )
        module = ModuleType(name)
        module.foreshock_detectors = hookimpl(lambda changed=changed: [changed])
        plugin = REGISTRY._extra.get(name) or REGISTRY._points[name].load()
        if hasattr(plugin, "foreshock_precursors"):
            module.foreshock_precursors = plugin.foreshock_precursors
        modules[name] = module
    return Registry(modules)


def judged(
    scenario: Scenario, twin: Twin, supervisor: Supervisor, arm: Any, seed: int, *tables: dict[str, Any]
) -> tuple[Run, Notes]:
    """A run with these faults from FROM_S on, and what was noticed."""
    faults = parse_faults([{"from_s": FROM_S, **t} for t in tables], "faults")
    notes = Notes(scenario.mode)
    with_faults = msgspec.structs.replace(scenario, faults=faults)
    return simulate(with_faults, twin, supervisor, arm, seed, detail=False, journals=[notes]), notes  # type: ignore[list-item]


def earliest(found: Sequence[Notes], of: str, known: set[str]) -> str:
    """Who noticed in how many runs, and the median time after the fault began."""
    times: dict[str, list[float]] = {}
    for notes in found:
        for name, t in getattr(notes, of).items():
            if name not in known:
                times.setdefault(name, []).append(t - FROM_S)
    return ", ".join(
        f"{n} {len(ts)}/{len(found)} at {sorted(ts)[len(ts) // 2]:.2f} s" for n, ts in sorted(times.items())
    )


def effect() -> None:
    """Each fault on three modes."""
    for id_, cases in FAULTS.items():
        scenario = SCENARIOS[id_]
        with tempfile.TemporaryDirectory() as scratch:
            twin = build_twin(scenario, REGISTRY, Path(scratch))
            supervisor = Supervisor(scenario.supervisor(), Path(scenario.folder), REGISTRY)
            print(f"\n## {id_}\n\n| fault | accidents | level 3 | trust above honest absence by | unobserved | seen |")
            print("|---|---|---|---|---|---|")
            plain = [judged(scenario, twin, supervisor, "on", s) for s in SEEDS]
            known = {k for _, n in plain for k in n.kinds}
            off = sum(simulate(scenario, twin, None, "off", s, detail=False).accident for s in SEEDS)
            print(f"| unsupervised | {off}/{len(SEEDS)} | | | | |")
            hurt, at_rest = sum(r.accident for r, _ in plain), sum(r.max_level == 3 for r, _ in plain)
            print(
                f"| none | {hurt}/{len(SEEDS)} | {at_rest} | | {earliest([n for _, n in plain], 'health', set())} | |"
            )
            for label, names, table in cases:
                runs = [judged(scenario, twin, supervisor, "on", s, table) for s in SEEDS]
                worst = ""
                if names:
                    absent = Supervisor(scenario.supervisor(), Path(scenario.folder), honest(names.split()))
                    excess = []
                    for seed in SEEDS[:6]:
                        _, faulty = judged(scenario, twin, supervisor, "shadow", seed, table)
                        _, fair = judged(scenario, twin, absent, "shadow", seed)
                        for a, b in zip(faulty.trust, fair.trust, strict=True):
                            excess += [a[0] - b[0], a[1] - b[1]]
                    worst = f"{max(excess):+.3f}"
                    absent.close()
                hurt = sum(r.accident for r, _ in runs)
                at_rest = sum(r.max_level == 3 for r, _ in runs)
                notes = [n for _, n in runs]
                print(
                    f"| {label} | {hurt}/{len(SEEDS)} | {at_rest} | {worst} | {earliest(notes, 'health', set())} "
                    f"| {earliest(notes, 'kinds', known)} |",
                    flush=True,
                )
            supervisor.close()
            twin.close()


def freeze() -> None:
    """Every channel of every mode frozen alone: who notices in harmless running, and what it costs in the accident."""
    print("| mode | frozen channel | noticed in harmless running by | accidents: unsupervised, supervised, frozen |")
    print("|---|---|---|---|")
    seeds = SEEDS[:10]
    for id_, scenario in SCENARIOS.items():
        if scenario.expect != "accident":
            continue
        calm = SCENARIOS[f"{id_}-nominal"]
        calm = msgspec.structs.replace(calm, duration_s=min(calm.duration_s, 6.0))
        with tempfile.TemporaryDirectory() as scratch:
            twin = build_twin(scenario, REGISTRY, Path(scratch) / "a")
            still = build_twin(calm, REGISTRY, Path(scratch) / "b")
            supervisor = Supervisor(scenario.supervisor(), Path(scenario.folder), REGISTRY)
            guard = Supervisor(calm.supervisor(), Path(calm.folder), REGISTRY)
            off = sum(simulate(scenario, twin, None, "off", s, detail=False).accident for s in seeds)
            on = sum(judged(scenario, twin, supervisor, "on", s)[0].accident for s in seeds)
            _, bare = judged(calm, still, guard, "shadow", seeds[0])
            for channel in [c.name for c in still.channels] + ["*"]:
                table = {"kind": "freeze", "channel": channel}
                _, notes = judged(calm, still, guard, "shadow", seeds[0], table)
                seen = [
                    f"{k} unobserved at {t - FROM_S:.1f} s" for k, t in notes.health.items() if k not in bare.health
                ]
                seen += [f"{k} at {t - FROM_S:.1f} s" for k, t in notes.kinds.items() if k not in bare.kinds]
                hurt = sum(judged(scenario, twin, supervisor, "on", s, table)[0].accident for s in seeds)
                counts = f"{off}, {on}, {hurt} of {len(seeds)}"
                print(f"| {scenario.mode} | `{channel}` | {', '.join(seen) or 'nobody'} | {counts} |", flush=True)
            for x in (supervisor, guard, twin, still):
                x.close()


if __name__ == "__main__":
    for part in sys.argv[1:] or ("effect", "freeze"):
        {"effect": effect, "freeze": freeze}[part]()
