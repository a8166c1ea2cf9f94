"""``foreshock sensitivity``: what the model's answers depend on."""

from __future__ import annotations

from pathlib import Path

import click
from rich.progress import Progress

from foreshock.cli.output import OK, console, emit, notes, table
from foreshock.errors import BadInputError
from foreshock.sensitivity import RANGES, Index, Perturbed, Point, one_at_a_time, outcome, sobol_indices
from foreshock.taxonomy import builtin_taxonomy

__all__ = ["sensitivity"]

OUTPUTS = {
    "P, one precursor": "p_first",
    "P, two": "p_second",
    "P, three": "p_third",
    "time to gate": "gate_s",
}


@click.command()
@click.option("--mode", default="A1", show_default=True, help="Accident mode whose cascade (Table 3) is run.")
@click.option("--samples", type=click.IntRange(8), default=256, show_default=True, help="N, a power of two.")
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="Of the samples.")
@click.option("--out", type=click.Path(path_type=Path, file_okay=False), help="Folder for the pictures.")
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def sensitivity(mode: str, samples: int, seed: int, out: Path | None, as_json: bool) -> int:
    """Perturb the parameters one at a time, as the paper does, and all at once (Sobol indices, SALib)."""
    if samples & (samples - 1):
        raise BadInputError("--samples", f"{samples} is not a power of two", f"; take {1 << samples.bit_length() - 1}")
    taxonomy = builtin_taxonomy()
    kinds = [taxonomy.kind(k).id for k in taxonomy.mode(mode, "--mode").cascade]
    local = one_at_a_time(kinds, taxonomy)

    def answers(values: dict[str, float]) -> dict[str, float]:
        found = outcome(Point(**values), kinds, taxonomy)
        return {title: float(getattr(found, field)) for title, field in OUTPUTS.items()}

    try:
        with Progress(console=notes, transient=True, disable=as_json) as bar:
            task = bar.add_task("Sobol", total=samples * (len(RANGES) + 2))
            indices = sobol_indices(answers, RANGES, samples, seed, lambda: bar.advance(task))
        if out is not None:
            from foreshock.sensitivity.plots import sobol_figure, tornado_figure

            out.mkdir(parents=True, exist_ok=True)
            tornado_figure(local).savefig(out / "one-at-a-time.png", dpi=110)
            sobol_figure(indices).savefig(out / "sobol.png", dpi=110)
    except ImportError as e:
        hint = "; run: pip install 'foreshock[analysis]'"
        raise BadInputError("sensitivity", f"needs {e.name}, which is not installed", hint) from e
    if as_json:
        emit({"mode": mode, "one_at_a_time": local, "sobol": indices, "ranges": RANGES, "samples": samples})
        return OK
    _print(local, indices)
    if out is not None:
        console.print(f"pictures: {out / 'one-at-a-time.png'}, {out / 'sobol.png'}", markup=False)
    return OK


def _print(local: list[Perturbed], indices: dict[str, list[Index]]) -> None:
    yes = {True: "yes", False: "NO"}
    rows = []
    for p in local:
        o = p.outcome
        when = f"{o.gate_s:.2f}" if o.opened else "never"
        claims = (yes[p.low_when_isolated], yes[p.sharp], yes[p.recovers])
        name = f"{p.name} = {p.value:g}" if p.name else "the paper's"
        rows.append((name, f"{o.p_first:.3f}", f"{o.p_second:.3f}", f"{o.p_third:.3f}", when, *claims))
    columns = ("P, one", "two", "three", "gate (s)", "low if isolated", "sharp", "recovers")
    table("One at a time, and the paper's claims", "parameters", *columns, rows=rows, right=columns[:4])
    names = [i.name for i in next(iter(indices.values()))]
    shares = [
        (name, *(f"{mine[k].first:.2f} / {mine[k].total:.2f} ± {mine[k].total_half:.2f}" for mine in indices.values()))
        for k, name in enumerate(names)
    ]
    title = "Sobol indices, first / total, with the half width of the total's 95% interval"
    table(title, "parameter", *indices, rows=shares, right=tuple(indices))
