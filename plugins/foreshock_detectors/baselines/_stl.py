"""``stl``: protects while a formula of signal temporal logic over the precursors is violated, by RTAMT."""

from __future__ import annotations

import re
from collections.abc import Sequence

import msgspec

from foreshock._strict import within
from foreshock.clock import ns
from foreshock.errors import ConfigError, nearest
from foreshock.policy import Proposal, Situation
from foreshock.records import Precursor
from foreshock.stl import WORDS, specification
from foreshock.taxonomy import builtin_taxonomy
from foreshock_detectors.baselines._protective import Protective, check

__all__ = ["Stl", "StlConfig"]

NAME = re.compile(r"(?<![\w.])[A-Za-z_]\w*")
SUFFIXES = ("_onset", "_severity")


class StlConfig(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """Settings.

    A formula names kinds of the taxonomy with ``_`` for ``-``. Of a kind k there are three signals: ``k`` is 1 from
    its first onset in the window on, else -1; ``k_onset`` is 1 in the samples in which it began, else -1;
    ``k_severity`` is its severity (the window's maximum) from its first onset on, else 0.

    Attributes:
        mode: whose actions it takes.
        formula: what must hold at every sample of the window, e.g. ``always(not(foot_micro_slip > 0 and
            eventually[0:1.5](torso_angular_spike > 0)))``; empty takes this of the first two kinds of the cascade.
        actions: what it does; None takes the mode's protective actions.
        window_s: how far back it looks, at most the window of the evidence: what has left that is forgotten.
        step_s: sampling step, of which the bounds in the formula are multiples.
    """

    mode: str
    formula: str = ""
    actions: tuple[str, ...] | None = None
    window_s: float = 1.5
    step_s: float = 0.05

    def __post_init__(self) -> None:
        check(self.mode, self.actions)
        within("window_s", self.window_s, 0.0, 60.0, above=True)
        within("step_s", self.step_s, 0.001, self.window_s)


class Stl:
    """Acts while the robustness of the formula on the window's evidence is not above 0.

    A pure function: the precursors carry the onsets that still count, so that the last window_s are sampled backwards
    from now and evaluated anew in every tick; nothing is remembered between ticks and nothing needs a reset. The
    formula must hold at every sample; ``eventually`` and ``until`` read what has been seen so far (weak at the end of
    the trace), so that a violation shows in the tick in which it happens, while ``pastify`` would tell it after the
    formula's horizon. By the same token a demand that something follow is violated until it does.

    Raises:
        ConfigError: RTAMT refuses the formula, or it names what is no kind.
        MissingExtraError: RTAMT is not installed.
    """

    def __init__(self, config: StlConfig) -> None:
        self._do = Protective(config.mode, config.actions)
        first, second = (k.replace("-", "_") for k in self._do.cascade[:2])
        default = f"always(not({first} > 0 and eventually[0:{config.window_s:g}]({second} > 0)))"
        self._formula = config.formula.strip() or default
        self._step_ns, self._count = ns(config.step_s), round(config.window_s / config.step_s) + 1
        self._signals = _signals(self._formula)
        self._kinds = frozenset(kind for kind, _ in self._signals.values())
        names = tuple(self._signals)
        self._evaluate = specification(self._formula, names, config.step_s, "policies", "policy 'stl'").evaluate
        self._times = [k * config.step_s for k in range(self._count)]
        try:
            self._calm = self.robustness((), 0)
        except Exception as e:
            raise ConfigError("formula", f"RTAMT cannot evaluate {self._formula!r}: {e}") from e
        if not self._calm > 0.0:
            raise ConfigError(
                "formula", f"{self._formula!r} is violated while no precursor is present", "; it always acts"
            )

    def propose(self, situation: Situation) -> Sequence[Proposal]:
        """What holds now."""
        seen = [p for p in situation.precursors if p.kind in self._kinds]
        value = self.robustness(seen, situation.now_ns) if seen else self._calm
        return () if value > 0.0 else self._do.proposals(f"robustness {value:g} of {self._formula}")

    def robustness(self, seen: Sequence[Precursor], now_ns: int) -> float:
        """The least robustness over the window; above 0 the formula holds."""
        stamps = [now_ns - k * self._step_ns for k in range(self._count - 1, -1, -1)]
        data: dict[str, list[float]] = {"time": self._times}
        for name, (kind, what) in self._signals.items():
            mine = [p for p in seen if p.kind == kind]
            data[name] = [self._sampled(mine, what, t) for t in stamps]
        return min(float(value) for _, value in self._evaluate(data))

    def _sampled(self, mine: Sequence[Precursor], what: str, t_ns: int) -> float:
        if what == "_severity":
            return max((p.severity for p in mine if p.onset_ns <= t_ns), default=0.0)
        if what == "_onset":
            onsets = (o for p in mine for o in p.onsets_ns or (p.onset_ns,))
            return 1.0 if any(t_ns - self._step_ns < o <= t_ns for o in onsets) else -1.0
        return 1.0 if any(p.onset_ns <= t_ns for p in mine) else -1.0


def _signals(formula: str) -> dict[str, tuple[str, str]]:
    """Kind and suffix of every signal that a formula names.

    Raises:
        ConfigError: it names what is no kind, or nothing at all.
    """
    kinds = {k.id.replace("-", "_"): k.id for k in builtin_taxonomy().kinds}
    found: dict[str, tuple[str, str]] = {}
    for name in dict.fromkeys(NAME.findall(formula)):
        if name in WORDS:
            continue
        suffix = next((s for s in SUFFIXES if name.endswith(s) and name not in kinds), "")
        stem = name.removesuffix(suffix)
        if stem not in kinds:
            raise ConfigError("formula", f"{name!r} is no kind of precursor", nearest(stem, kinds))
        found[name] = (kinds[stem], suffix)
    if not found:
        raise ConfigError("formula", f"{formula!r} names no kind of precursor, e.g. foot_micro_slip")
    return found
