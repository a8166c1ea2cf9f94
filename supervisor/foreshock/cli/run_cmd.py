"""``foreshock run``: a live supervisor."""

from __future__ import annotations

import gc
import threading
from pathlib import Path

import click
from rich.markup import escape

from foreshock.cli.output import NEGATIVE, OK, console, emit, notes
from foreshock.errors import BadInputError
from foreshock.live import LiveSupervisor, load_run, watch_log
from foreshock.records import Decision, ProtectionLevel

__all__ = ["run"]


@click.command()
@click.argument("config", type=click.Path(path_type=Path, exists=True, dir_okay=False))
@click.option("--seconds", type=click.FloatRange(0.0, min_open=True), help="End after this time; never by default.")
@click.option("--journal", type=click.Path(path_type=Path, dir_okay=False), help="Record everything in this MCAP file.")
@click.option("--json", "as_json", is_flag=True, help="Print the status at the end as JSON.")
def run(config: Path, seconds: float | None, journal: Path | None, as_json: bool) -> int:
    """Supervise a robot live over Zenoh, as CONFIG says, until SIGINT or SIGTERM.

    It takes the robot's streams, and publishes decisions, interventions, health and the motion lease; watch it with
    foreshock top. Exit code 1 if its journal could not be written to the end: it grants no lease from then on.
    """
    if journal is not None and journal.exists():
        raise BadInputError("--journal", f"{journal} exists; a journal is never overwritten", "; choose another name")
    loaded = load_run(config)
    live = LiveSupervisor(loaded, config.parent, journal=journal, denied=watch_log(loaded.link))
    stop = threading.Event()
    last, told = ProtectionLevel.NORMAL, False
    timer = threading.Timer(seconds, stop.set) if seconds is not None else None

    def ticked(decision: Decision) -> None:
        nonlocal last, told
        if live.unrecorded and not told:
            told = True
            notes.print(f"[bold red]no lease from now on:[/] {escape(live.unrecorded)}", soft_wrap=True)
        if decision.level is not last:
            modes = ", ".join(m for m, level in decision.levels.items() if level)
            said = f"level {decision.level.name.lower().replace('_', '-')} {modes}".rstrip()
            notes.print(said, markup=False)
            last = decision.level

    if not as_json:
        status = live.status()
        notes.print(f"supervising {status.robot}, epoch {status.epoch}: {len(status.streams)} streams", markup=False)
    if timer is not None:
        timer.daemon = True
        timer.start()
    gc.collect()
    gc.freeze()  # a full collection would walk through all that set-up made, in the middle of a tick
    try:
        final = live.run(stop, ticked)
    finally:
        if timer is not None:
            timer.cancel()
    if as_json:
        emit(final)
    else:
        median, p99, most = final.tick_ms
        console.print(f"{final.tick + 1} ticks, {median:.2f} ms median, {p99:.2f} ms p99, {most:.2f} ms at most")
    return NEGATIVE if live.unrecorded else OK
