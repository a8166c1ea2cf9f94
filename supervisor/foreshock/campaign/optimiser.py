"""Points of a parameter space, each chosen in the light of those before it, by Optuna."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Literal, TypeAlias

from foreshock.errors import MissingExtraError
from foreshock.session.scenario import Distribution

__all__ = ["Optimiser", "OptimiserKind", "support"]

OptimiserKind: TypeAlias = Literal["tpe", "random"]
STARTUP = 10
"""Points at random before there is something to learn from."""


def support(distribution: Distribution) -> tuple[float, ...]:
    """Lowest and highest value that is drawn, or all of them where it is a choice."""
    if distribution.uniform is not None:
        return distribution.uniform
    if distribution.normal is not None:
        mean, sd = distribution.normal
        return mean - 3.0 * sd, mean + 3.0 * sd
    return tuple(sorted(set(distribution.choice or ())))


class Optimiser:
    """Minimises over a box: TPE (Bergstra et al. 2011, multivariate), or random points to compare with.

    Points may be asked for before those before them are told of; the sequence follows from the seed.

    Args:
        space: distributions by parameter; only their support counts.
        kind: of search.
        seed: of the sampler.

    Raises:
        MissingExtraError: optuna is not installed.
    """

    def __init__(self, space: Mapping[str, Distribution], kind: OptimiserKind, seed: int) -> None:
        try:
            import optuna
        except ImportError as e:
            raise MissingExtraError("falsify", f"needs {e.name}", "; run: pip install 'foreshock[campaign]'") from e
        optuna.logging.set_verbosity(optuna.logging.WARNING)
        self._space = {
            name: optuna.distributions.CategoricalDistribution(support(d))
            if d.choice is not None
            else optuna.distributions.FloatDistribution(min(support(d)), max(support(d)))
            for name, d in space.items()
        }
        sampler: Any = (
            optuna.samplers.RandomSampler(seed=seed)
            if kind == "random"
            else optuna.samplers.TPESampler(seed=seed, n_startup_trials=STARTUP, multivariate=True, constant_liar=True)
        )
        self._study: Any = optuna.create_study(sampler=sampler)
        self._failed = optuna.trial.TrialState.FAIL

    def ask(self) -> tuple[Any, dict[str, float]]:
        """A point, and what to tell of it by."""
        trial = self._study.ask(self._space)
        return trial, {name: float(value) for name, value in trial.params.items()}

    def tell(self, trial: Any, value: float | None) -> None:
        """What it came to; None where it gave no result, from which nothing is learnt."""
        if value is None:
            self._study.tell(trial, state=self._failed)
        else:
            self._study.tell(trial, value)
