"""``foreshock replay``."""

from __future__ import annotations

from pathlib import Path

import click
import msgspec
from rich.markup import escape
from rich.progress import Progress

from foreshock._strict import read_toml
from foreshock.cli.output import NEGATIVE, OK, console, emit, notes, table
from foreshock.config import Config, parse_config
from foreshock.errors import BadInputError, ConfigError
from foreshock.recording import is_journal
from foreshock.session.bags import BagReplay, replay_bag
from foreshock.session.replay import Replay
from foreshock.session.replay import replay as run_replay

__all__ = ["replay"]


@click.command()
@click.argument("file", type=click.Path(path_type=Path, exists=True))
@click.option(
    "--config",
    type=click.Path(path_type=Path, exists=True, dir_okay=False),
    help="Another configuration: what would have happened. A ROS 2 bag needs one.",
)
@click.option("--report", type=click.Path(path_type=Path, dir_okay=False), help="Of a bag: statistics as HTML.")
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def replay(file: Path, config: Path | None, report: Path | None, as_json: bool) -> int:
    """Make the decisions of a journal FILE again and compare their digests, or run a ROS 2 bag through a supervisor.

    A bag (MCAP or SQLite) needs --config; its table [topics] maps topics to channels below the robot's. Exit code 1
    if a journal was altered or a decision differs; with --config decisions may differ.
    """
    if not is_journal(file):
        if config is None:
            raise BadInputError(str(file), "is not a journal of Foreshock", "; a ROS 2 bag needs --config")
        return _bag(file, config, report, as_json)
    if report is not None:
        raise BadInputError("--report", "is for bags", "; a run's report is that of foreshock simulate")
    other = _configuration(config)[0] if config is not None else None
    with Progress(console=notes, transient=True, disable=as_json) as bar:
        task = bar.add_task("ticks", total=None)
        result = run_replay(
            file, config=other, base=config.parent if config else None, done=lambda _: bar.update(task, advance=1)
        )
    fine = result.altered_at is None and (result.foreign or result.agrees)
    if as_json:
        emit(result)
    else:
        _print(result, config)
    return OK if fine else NEGATIVE


def _configuration(path: Path) -> tuple[Config, dict[str, str]]:
    """A configuration, and its topics; the tables of a live run are left aside."""
    data = read_toml(path)
    topics = data.pop("topics", {})
    if not isinstance(topics, dict) or not all(isinstance(v, str) for v in topics.values()):
        raise ConfigError(f"{path}: topics", f"{topics!r} is no table of topic = channel")
    for name in ("link", "live", "journal"):
        data.pop(name, None)
    return parse_config(data, str(path)), topics


def _print(result: Replay, config: Path | None) -> None:
    rows = [(name, str(count)) for name, count in result.levels.items()]
    table(f"{result.journal}: {result.ticks} ticks in {result.seconds:.1f} s", "level", "ticks", rows=rows)
    if result.warning:
        console.print(f"[yellow]{escape(result.warning)}[/]")
    if result.altered_at is not None:
        console.print(f"[red]altered, at tick {result.altered_at}: {escape(result.altered)}[/]")
    if result.foreign:
        said = "the same as" if result.differs_at is None else f"not those, from tick {result.differs_at} on, of"
        console.print(f"decisions with {config} are {said} the recorded configuration", markup=False)
    elif result.differs_at is not None:
        console.print(f"[red]decisions differ from tick {result.differs_at} on[/]")
    elif result.altered_at is None:
        console.print(f"[green]decisions agree[/]: {result.replayed}")


def _bag(file: Path, config: Path, report: Path | None, as_json: bool) -> int:
    mine, topics = _configuration(config)
    with Progress(console=notes, transient=True, disable=as_json) as bar:
        task = bar.add_task("ticks", total=None)
        result = replay_bag(file, mine, topics, config.parent, done=lambda _: bar.update(task, advance=1))
    if report is not None:
        try:
            from foreshock.report.statistics import write_statistics
        except ImportError as e:
            raise BadInputError("--report", f"needs {e.name}", "; run: pip install 'foreshock[report]'") from e
        write_statistics(report, f"{file} under {config}", result.series, result.units, _notes(result))
    if as_json:
        emit(msgspec.structs.replace(result, series={}))
        return OK
    rows = [(kind, f"{t:.3f}") for kind, t in sorted(result.first_s.items(), key=lambda item: item[1])]
    title = f"{file}: {result.ticks} ticks in {result.seconds:.1f} s"
    table(title, "precursor", "first at (s)", rows=rows, right=("first at (s)",))
    for note in _notes(result):
        console.print(note, markup=False)
    if report is not None:
        console.print(f"report: {report}", markup=False)
    return OK


def _notes(r: BagReplay) -> list[str]:
    found = [f"levels: {', '.join(f'{name} in {n} ticks' for name, n in r.levels.items())}"]
    found.append(f"samples: {', '.join(f'{n} on {channel}' for channel, n in sorted(r.samples.items()))}")
    found += [f"missing: {channel}, which a detector needs" for channel in r.missing]
    found += [f"not read: {topic}" for topic in r.unread]
    found += [f"faults on {topic}: {why}" for topic, why in r.faults.items()]
    return found
