"""The root command, and how every error ends: one message with place and nearest name, and an exit code."""

from __future__ import annotations

import os
import signal
import sys
import threading
import traceback

import click
from rich.markup import escape

from foreshock.cli.calibrate_cmd import calibrate
from foreshock.cli.campaign_cmd import campaign
from foreshock.cli.config_cmd import config
from foreshock.cli.demo_cmd import demo
from foreshock.cli.detectors_cmd import detectors
from foreshock.cli.doctor_cmd import doctor
from foreshock.cli.events_cmd import events
from foreshock.cli.falsify_cmd import falsify
from foreshock.cli.gates_cmd import gates
from foreshock.cli.journal_cmd import journal
from foreshock.cli.operator_cmd import reset
from foreshock.cli.output import BAD_INPUT, FAILED, INTERRUPTED, OK, TERMINATED, emit, notes
from foreshock.cli.pictures_cmd import pictures
from foreshock.cli.policies_cmd import policies
from foreshock.cli.replay_cmd import replay
from foreshock.cli.run_cmd import run
from foreshock.cli.scenarios_cmd import scenarios
from foreshock.cli.security_cmd import security
from foreshock.cli.sensitivity_cmd import sensitivity
from foreshock.cli.simulate_cmd import simulate
from foreshock.cli.taxonomy_cmd import taxonomy
from foreshock.cli.top_cmd import top
from foreshock.cli.twin_cmd import twin
from foreshock.errors import BadInputError, ForeshockError, TwinError, nearest

__all__ = ["cli", "main"]


class _Terminated(BaseException):
    """SIGTERM came; as KeyboardInterrupt does, it passes what catches Exception, and unwinds what must be ended."""


def _on_sigterm(*_: object) -> None:
    # Once: a second one, which timeout(1) sends, must not cut the ending short. No SIG_IGN, which children inherit.
    signal.signal(signal.SIGTERM, _on_another)
    raise _Terminated


def _on_another(*_: object) -> None:
    pass


class _Root(click.Group):
    """A group that names the nearest command."""

    def resolve_command(
        self, ctx: click.Context, args: list[str]
    ) -> tuple[str | None, click.Command | None, list[str]]:
        if args and not args[0].startswith("-") and self.get_command(ctx, args[0]) is None:
            hint = nearest(args[0], self.list_commands(ctx))
            raise click.UsageError(f"no command {args[0]!r}{hint}", ctx)
        return super().resolve_command(ctx, args)


@click.group(cls=_Root, context_settings={"help_option_names": ["-h", "--help"], "max_content_width": 100})
@click.version_option(package_name="foreshock")
def cli() -> None:
    """Foreshock: a safety supervisor for humanoid robots.

    Precursors in, accident probability and trust, graded interventions out.

    Exit codes: 0 ok; 1 a negative result; 2 bad input; 3 an internal failure or a twin that failed;
    130 interrupted (SIGINT); 143 ended by SIGTERM.
    """


COMMANDS = (
    calibrate, campaign, config, demo, detectors, doctor, events, falsify, gates, journal, pictures, policies, replay,
    reset, run, scenarios, security, sensitivity, simulate, taxonomy, top, twin,
)  # fmt: skip
for command in COMMANDS:
    cli.add_command(command)


def main(args: list[str] | None = None) -> None:
    """Run the command line and exit."""
    words = sys.argv[1:] if args is None else args
    as_json = "--json" in words
    code, kind, message = OK, "", ""
    handles = threading.current_thread() is threading.main_thread()
    before = signal.signal(signal.SIGTERM, _on_sigterm) if handles else None
    try:
        result = cli.main(words, prog_name="foreshock", standalone_mode=False)
        code = result if isinstance(result, int) else OK
    except click.exceptions.Exit as e:
        code = e.exit_code
    except click.Abort:
        code, kind, message = INTERRUPTED, "interrupted", "interrupted"
    except _Terminated:
        code, kind, message = TERMINATED, "terminated", "ended by SIGTERM"
    except click.ClickException as e:
        code, kind, message = BAD_INPUT, "usage", e.format_message()
    except BadInputError as e:
        code, kind, message = BAD_INPUT, type(e).__name__, str(e)
    except TwinError as e:
        code, kind, message = FAILED, f"twin {e.kind}", str(e)
    except ForeshockError as e:
        code, kind, message = FAILED, type(e).__name__, str(e)
    except OSError as e:
        code, kind, message = BAD_INPUT, type(e).__name__, f"{e.filename or 'file'}: {e.strerror or e}"
    except Exception as e:  # noqa: BLE001 # the last resort of the program: a user gets one line, not a traceback
        code, kind, message = FAILED, "internal", f"internal failure: {type(e).__name__}: {e}"
        if os.environ.get("FORESHOCK_TRACEBACK"):
            traceback.print_exc()
    finally:
        if before is not None and code != TERMINATED:
            signal.signal(signal.SIGTERM, before)
    if message:
        if as_json:
            emit(None, [{"kind": kind, "message": message}])
        else:
            notes.print(f"[bold red]error:[/] {escape(message)}", soft_wrap=True)
    if code == TERMINATED:
        # the interpreter takes handlers back while it ends, but not this; no child is started any more that inherits it
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
    sys.exit(code)
