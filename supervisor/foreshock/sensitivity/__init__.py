"""How much the model's answers depend on its parameters: one at a time as in the paper, and globally."""

from foreshock.sensitivity.factors import Factor
from foreshock.sensitivity.local import LOW, Claims, Perturbed, one_at_a_time
from foreshock.sensitivity.outcome import Outcome, outcome
from foreshock.sensitivity.page import write_sensitivity_report
from foreshock.sensitivity.plots import sobol_figure, timelines_figure, tornado_figure
from foreshock.sensitivity.sobol import Index, Indices, Interaction, sobol_indices
from foreshock.sensitivity.study import OUTPUTS, Output, Study
from foreshock.sensitivity.timeline import Episode, Timeline, timelines_of
from foreshock.sensitivity.trajectory import Moment, trajectory

__all__ = [
    "LOW",
    "OUTPUTS",
    "Claims",
    "Episode",
    "Factor",
    "Index",
    "Indices",
    "Interaction",
    "Moment",
    "Outcome",
    "Output",
    "Perturbed",
    "Study",
    "Timeline",
    "one_at_a_time",
    "outcome",
    "sobol_figure",
    "sobol_indices",
    "timelines_figure",
    "timelines_of",
    "tornado_figure",
    "trajectory",
    "write_sensitivity_report",
]
