"""``foreshock twin``: host a twin behind Zenoh."""

from __future__ import annotations

import tempfile
import threading
from pathlib import Path

import click

from foreshock.cli._link import STEPPED_ENDPOINT, Joining, join_options
from foreshock.cli.output import OK, console, emit, notes
from foreshock.link import DEFAULT_ENDPOINT
from foreshock.live import FreeRunning, SteppedServer
from foreshock.registry import Registry
from foreshock.session.isolated import build_twin
from foreshock.session.scenario import find_scenario

__all__ = ["twin"]


@click.group()
def twin() -> None:
    """Digital twins behind Zenoh."""


@twin.command()
@click.argument("scenario")
@click.option("--real-time", is_flag=True, help="Run freely on this machine's clock; otherwise it is stepped by query.")
@click.option("--listen", help=f"Endpoint to be stepped at.  [default: {STEPPED_ENDPOINT}]")
@join_options("this twin", f"Endpoint of the supervisor.  [default with --real-time: {DEFAULT_ENDPOINT}]")
@click.option("--seed", type=click.IntRange(0), default=0, show_default=True, help="Of a run in real time.")
@click.option("--seconds", type=click.FloatRange(0.0, min_open=True), help="End after this time; never by default.")
@click.option("--json", "as_json", is_flag=True, help="Print the result as JSON.")
def serve(
    scenario: str,
    real_time: bool,
    listen: str | None,
    join: Joining,
    seed: int,
    seconds: float | None,
    as_json: bool,
) -> int:
    """Host the twin of SCENARIO behind Zenoh, until SIGINT or SIGTERM.

    Stepped: foreshock simulate SCENARIO --twin zenoh:ENDPOINT drives it, with the same digest as in process. In real
    time: it streams to a supervisor (foreshock run), holds its motion lease and obeys its interventions.
    """
    registry = Registry()
    found = find_scenario(scenario, registry)
    robot = found.supervisor().supervisor.robot
    link = join.settings("peer") if real_time else join.settings("client", listen=listen or STEPPED_ENDPOINT)
    stop = threading.Event()
    with tempfile.TemporaryDirectory(prefix="foreshock-") as scratch:
        hosted = build_twin(found, registry, Path(scratch))
        timer = threading.Timer(seconds, stop.set) if seconds is not None else None
        try:
            if timer is not None:
                timer.daemon = True
                timer.start()
            if real_time:
                hosted.reset(found.drawn(seed), seed)
                running = FreeRunning(hosted, robot, link)
                notes.print(f"{found.id} streams to {link.connect[0]}", markup=False)
                late_s = running.run(stop)
                said = f"at worst {late_s * 1e3:.1f} ms late"
                result = {"late_s": late_s, "guard": running.guard.counts, "events": hosted.events()}
            else:
                notes.print(f"{found.id} is stepped at {', '.join((*link.listen, *link.connect))}", markup=False)
                SteppedServer(hosted, robot, link).serve(stop)
                result, said = {}, ""
        finally:
            if timer is not None:
                timer.cancel()
            hosted.close()
    if as_json:
        emit(result)
    elif said:
        console.print(said, markup=False)
    return OK
