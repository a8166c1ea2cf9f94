"""What commands that do many runs share: their progress bar, and the ranges that parameters are drawn from."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import click
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from foreshock.cli.output import notes
from foreshock.session.isolated import Failure
from foreshock.session.run import Run

__all__ = ["ranges", "runs_bar"]


@contextmanager
def runs_bar(title: str, total: int) -> Iterator[Callable[[int, Run | Failure], None]]:
    """A progress bar with the number of failures; gives what is to be told of each run as it ends."""
    with Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeRemainingColumn(),
        TextColumn("{task.fields[failed]} failed"),
        console=notes,
        transient=True,
    ) as bar:
        task = bar.add_task(title, total=total, failed=0)
        failed = 0

        def done(_: int, result: Run | Failure) -> None:
            nonlocal failed
            failed += isinstance(result, Failure)
            bar.update(task, advance=1, failed=failed)

        yield done


def ranges(_: click.Context, __: click.Parameter, given: tuple[str, ...]) -> dict[str, tuple[float, float]]:
    """NAME=LOW:HIGH by name; finite, and LOW not above HIGH."""
    found = {}
    for item in given:
        name, _equals, span = item.partition("=")
        low, _colon, high = span.partition(":")
        try:
            limits = float(low), float(high)
        except ValueError:
            limits = math.nan, math.nan
        # NaN is neither finite nor below anything
        if not name or not all(map(math.isfinite, limits)) or not limits[0] <= limits[1]:
            raise click.BadParameter(f"{item!r} is not NAME=LOW:HIGH")
        found[name] = limits
    return found
