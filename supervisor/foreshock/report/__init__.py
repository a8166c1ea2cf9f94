"""Self-contained HTML reports with plots."""

from foreshock.report.html import write_report
from foreshock.report.plots import runs_figure, sweep_figure

__all__ = ["runs_figure", "sweep_figure", "write_report"]
