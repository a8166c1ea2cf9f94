"""The command line: ``foreshock``."""

from foreshock.cli.main import cli, main

__all__ = ["cli", "main"]
