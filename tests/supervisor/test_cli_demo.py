"""The sweep table of ``foreshock demo``, with counts of the default size and above."""

from __future__ import annotations

import pytest
from rich.console import Console

from foreshock.cli import demo_cmd, output
from foreshock.session.rates import wilson
from foreshock.session.sweep import CellResult


def result(cell: int, seeds: int, arm: str) -> CellResult:
    n = seeds if cell == 0 else seeds // 5
    point = demo_cmd.cells(seeds, seeds // 5)[cell]
    acted = wilson(0 if cell < 2 else n // 3, 0 if cell < 2 else n)
    return CellResult(point, arm, wilson(n, n), wilson(n, n), wilson(0, n), n, acted, (-0.27, -0.38), 0)


@pytest.mark.parametrize("seeds", [2, 50, 100])
def test_the_sweep_table_has_one_line_a_row_at_120_columns(
    seeds: int, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(output, "console", Console(width=120, highlight=False))
    labels = [arm.label for arm in demo_cmd.ARMS]
    cells = demo_cmd.cells(seeds, max(1, seeds // 5))
    demo_cmd._print_sweep([result(c, max(5, seeds), label) for c in range(len(cells)) for label in labels])
    lines = capsys.readouterr().out.splitlines()
    rows = [line for line in lines if line.startswith("│")]
    assert max(map(len, lines)) <= 120
    assert [row.split("│")[1].strip() for row in rows] == [
        c.label if c.factor == c.label else f"{c.factor} {c.label}" for c in cells
    ]
    heads = [line for line in lines if line.startswith("┃")]
    assert [" ".join(h.split("┃")[k].strip() for h in heads) for k in (2, 3, 4)] == [
        "fell: unsupervised",
        "fell: paper's gate",
        "fell: ladder",
    ]
