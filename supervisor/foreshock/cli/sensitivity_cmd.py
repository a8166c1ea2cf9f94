"""``foreshock sensitivity``: what the model's answers depend on, and whether the paper's claims survive."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

from foreshock.cli.output import OK, console, emit, notes, table
from foreshock.errors import BadInputError, MissingExtraError
from foreshock.risk import RiskSettings, load_parameters
from foreshock.taxonomy import builtin_taxonomy

if TYPE_CHECKING:
    from foreshock.sensitivity import Indices, Perturbed, Study

__all__ = ["sensitivity"]

SHOWN = ("p-third", "gate", "opens", "recovery")
"""Outputs whose indices are printed; the report has all."""


@click.command()
@click.option("--mode", default="A1", show_default=True, help="Accident mode whose cascade (Table 3) is run.")
@click.option(
    "--model",
    type=click.Choice(["independent", "correlated"]),
    default="independent",
    show_default=True,
    help="Eq. 1 of the paper, or its extension to correlated precursors.",
)
@click.option("--parameters", default="", help="Of the correlated model: a file, or table-3 (the default).")
@click.option("--samples", type=click.IntRange(16), default=512, show_default=True, help="N, a power of two.")
@click.option("--second-order", is_flag=True, help="Find the interactions of pairs too; takes twice as long.")
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="Of the samples.")
@click.option(
    "--out",
    type=click.Path(path_type=Path, file_okay=False),
    default=Path("out/sensitivity"),
    show_default=True,
    help="Folder for report and pictures.",
)
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def sensitivity(
    mode: str,
    model: Literal["independent", "correlated"],
    parameters: str,
    samples: int,
    second_order: bool,
    seed: int,
    out: Path,
    as_json: bool,
) -> int:
    """Perturb the parameters one at a time, as the paper does, and all at once (Sobol indices, SALib)."""
    if samples & (samples - 1):
        raise BadInputError("--samples", f"{samples} is not a power of two", f"; take {1 << samples.bit_length() - 1}")
    taxonomy = builtin_taxonomy()
    kinds = [taxonomy.kind(k).id for k in taxonomy.mode(mode, "--mode").cascade]
    chosen = RiskSettings(model, parameters)
    nominal = chosen.loaded(Path(), taxonomy) if model == "correlated" else load_parameters("table-3", Path(), taxonomy)
    try:
        from foreshock.sensitivity import (
            Study,
            one_at_a_time,
            sobol_figure,
            sobol_indices,
            timelines_figure,
            tornado_figure,
            write_sensitivity_report,
        )
    except ImportError as e:
        raise MissingExtraError("sensitivity", f"needs {e.name}", "; run: pip install 'foreshock[analysis]'") from e
    out.mkdir(parents=True, exist_ok=True)
    study = Study(nominal, model, kinds, taxonomy)
    local = one_at_a_time(study)
    n = len(study.factors)
    columns = (TextColumn("{task.description}"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn())
    with Progress(*columns, console=notes, transient=True, disable=as_json) as bar:
        task = bar.add_task("Sobol", total=samples * (2 * n + 2 if second_order else n + 2))
        indices = sobol_indices(
            study.answers,
            {f.id: (f.low, f.high) for f in study.factors},
            samples,
            seed,
            lambda: bar.advance(task),
            second_order=second_order,
        )
    command = _command(mode, model, parameters, samples, seed, second_order)
    write_sensitivity_report(out / "report.html", study, local, indices, samples, command)
    timelines_figure(study, study.outcomes()).savefig(out / "timelines.png", dpi=110)
    tornado_figure(study, local).savefig(out / "one-at-a-time.png", dpi=110)
    sobol_figure(study, indices).savefig(out / "sobol.png", dpi=110)
    files = [str(out / name) for name in ("report.html", "timelines.png", "one-at-a-time.png", "sobol.png")]
    if as_json:
        emit(
            {
                "mode": mode,
                "model": model,
                "parameters": nominal.name,
                "samples": samples,
                "seed": seed,
                "factors": study.factors,
                "one_at_a_time": local,
                "sobol": indices,
                "files": files,
            }
        )
        return OK
    _print(study, local, indices)
    console.print("report: " + files[0], markup=False, soft_wrap=True)
    return OK


def _command(mode: str, model: str, parameters: str, samples: int, seed: int, second_order: bool) -> str:
    words = ["foreshock", "sensitivity", "--mode", mode, "--model", model]
    words += ["--parameters", parameters] if parameters else []
    words += ["--samples", str(samples), "--seed", str(seed)]
    return shlex.join(words + (["--second-order"] if second_order else []))


def _print(study: Study, local: Sequence[Perturbed], indices: Sequence[Indices]) -> None:
    symbols = {f.id: f.symbol for f in study.factors}
    titles = {o.id: o.title for o in study.outputs}
    yes = {True: "yes", False: "NO"}
    rows = []
    for p in local:
        a, c = p.answers, p.claims
        numbers = [f"{a[id_]:.3f}" for id_ in ("p-first", "p-second", "p-third")]
        times = (f"{a['gate']:.2f}", f"{a['recovery']:.2f}") if a["opens"] else ("never", "–")
        name = f"{symbols[p.factor]} = {p.value:.3g}" if p.factor else "nothing"
        rows.append((name, *numbers, *times, yes[c.low], yes[c.sharp], yes[c.opens], yes[c.recovers]))
    numeric = ("P, one", "two", "three", "gate (s)", "recovery (s)")
    claims = ("low", "sharp", "opens", "recovers")
    table("One at a time, and the paper's claims", "perturbed", *numeric, *claims, rows=rows, right=numeric)
    shown = [i for i in indices if i.output in SHOWN]
    shares = []
    for k, f in enumerate(study.factors):
        cells = []
        for mine in shown:
            i = mine.factors[k] if mine.factors else None
            cells.append(f"{i.first:.2f} / {i.total:.2f} ± {i.total_half:.2f}" if i else "–")
        shares.append((f.symbol, *cells))
    shares.append(("largest change, N/2 → N", *(f"{i.moved:.3f}" for i in shown)))
    heads = tuple(titles[i.output] for i in shown)
    title = "Sobol indices: first order / total ± half of its 95% interval"
    table(title, "parameter", *heads, rows=shares, right=heads)
