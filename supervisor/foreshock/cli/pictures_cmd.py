"""``foreshock pictures``: a run without and with the supervisor, side by side, as a film and as stills."""

from __future__ import annotations

import tempfile
from pathlib import Path

import click
import msgspec

from foreshock._strict import convert
from foreshock.cli._runs import runs_bar
from foreshock.cli.output import OK, console, emit, notes
from foreshock.cli.simulate_cmd import summary, values
from foreshock.errors import BadInputError, NoOpenGLError, TwinError
from foreshock.registry import Registry
from foreshock.session.captions import captions, moments
from foreshock.session.isolated import Failure, Job, placed, run_all
from foreshock.session.run import Arm, Run
from foreshock.session.scenario import Scenario, find_scenario
from foreshock.twin import Take, TwinSpec

__all__ = ["pictures"]

ARMS: tuple[tuple[Arm, str], ...] = (("shadow", "without supervisor"), ("on", "with supervisor"))
"""The first one is judged but not acted on, so that its trust can be shown too."""


@click.command()
@click.argument("scenario")
@click.option(
    "--out",
    type=click.Path(path_type=Path, file_okay=False),
    default=Path("out/pictures"),
    show_default=True,
    help="Folder for the files, which are named after the scenario and the seed.",
)
@click.option(
    "--film", type=click.Choice(["mp4", "gif", "none"]), default="mp4", show_default=True, help="Kind of film."
)
@click.option("--policy", help="Use this policy instead of the scenario's.")
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="Of all randomness.")
@click.option(
    "--set", "parameters", multiple=True, callback=values, metavar="NAME=NUMBER", help="Set a parameter of the twin."
)
@click.option("--duration", type=float, help="Simulated time in s; the scenario's own by default.")
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def pictures(
    scenario: str,
    out: Path,
    film: str,
    policy: str | None,
    seed: int,
    parameters: dict[str, float],
    duration: float | None,
    as_json: bool,
) -> int:
    """Run a scenario without and with the supervisor and draw both side by side: a film, and a strip of stills.

    Its twin must have pictures, as ``mujoco`` does. Where there is no OpenGL the pictures are left out, and it is said.
    """
    registry = Registry()
    found = find_scenario(scenario, registry).with_(parameters, policy)
    if duration is not None:
        found = msgspec.structs.replace(found, duration_s=duration)
    spec = registry.twin(found.twin["kind"], f"{found.id}: twin.kind")
    files = [out / f"{found.id}-{seed}.{suffix}" for suffix in (film, "png") if suffix != "none"]
    skipped = ""
    with tempfile.TemporaryDirectory(prefix="foreshock-") as scratch:
        shown = _both(found, spec, seed, Path(scratch))
        try:
            _draw(found, spec, shown, files)
        except NoOpenGLError as e:
            files, skipped = [], str(e)
    if as_json:
        runs = {take.title: msgspec.structs.replace(run, series={}) for take, run in shown}
        emit({"runs": runs, "files": [str(f) for f in files], "skipped": skipped})
        return OK
    for take, run in shown:
        console.print(f"{take.title}: {summary(run)}", soft_wrap=True)
    if skipped:
        notes.print(f"[yellow]{skipped}[/]", soft_wrap=True)
    for path in files:
        console.print(f"{'stills' if path.suffix == '.png' else 'film'}: {path}", markup=False)
    return OK


def _both(found: Scenario, spec: TwinSpec, seed: int, scratch: Path) -> list[tuple[Take, Run]]:
    """Both runs, with what moved in them."""
    if spec.pictures is None:
        raise BadInputError(f"{found.id}: twin.kind", f"{spec.id!r} has no pictures", "; a twin of kind 'mujoco' has")
    files = [scratch / f"{arm}.npz" for arm, _ in ARMS]
    jobs = [Job(found, arm, seed, poses=str(file)) for (arm, _), file in zip(ARMS, files, strict=True)]
    shown = []
    with runs_bar(found.id, len(jobs)) as done:
        results = run_all(jobs, workers=1, done=done)
    for (_, title), file, result in zip(ARMS, files, results, strict=True):
        if isinstance(result, Failure):
            raise TwinError(result.kind, result.detail, result.log)
        shown.append((Take(title, file, captions(result)), result))
    return shown


def _draw(found: Scenario, spec: TwinSpec, shown: list[tuple[Take, Run]], files: list[Path]) -> None:
    assert spec.pictures is not None  # noqa: S101 # _both has seen to it
    table = placed({k: v for k, v in found.twin.items() if k != "kind"}, Path(found.folder))
    config = convert(table, spec.config, f"{found.id}: twin")
    with notes.status("drawing"):
        spec.pictures(config, [take for take, _ in shown], moments([run for _, run in shown]), files)
