"""How much the model's answers depend on its parameters: one at a time as in the paper, and globally."""

from foreshock.sensitivity.cascade import PAPER, RANGES, Outcome, Point, outcome
from foreshock.sensitivity.local import Perturbed, one_at_a_time
from foreshock.sensitivity.sobol import Index, sobol_indices

__all__ = ["PAPER", "RANGES", "Index", "Outcome", "Perturbed", "Point", "one_at_a_time", "outcome", "sobol_indices"]
