"""Records of an MCAP file, up to its end or to where it is torn or damaged."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from foreshock.errors import BadInputError, MissingExtraError

__all__ = ["DamagedError", "Records"]


class DamagedError(BadInputError):
    """A file is damaged: what comes before can be saved."""

    def __init__(self, path: Path, problem: str) -> None:
        super().__init__(str(path), problem, f"; save what comes before with: foreshock journal recover {path} OUT")


class Records:
    """Iterates over the records of the data section, out of their chunks; ends without an error where the file is torn.

    Attributes:
        path: of the file.
        size: of the file, in bytes.
        at: so many bytes of it could be read whole.
    """

    def __init__(self, path: Path) -> None:
        self.path, self.at = path, 0
        if not path.is_file():
            raise BadInputError(str(path), "is no file")
        self.size = path.stat().st_size

    def __iter__(self) -> Iterator[Any]:
        """The records.

        Raises:
            BadInputError: it is no MCAP file, or not even its beginning is there.
            DamagedError: bytes in its middle are not those that were written.
            MissingExtraError: mcap is not installed.
        """
        try:
            from mcap.exceptions import InvalidMagic
            from mcap.stream_reader import StreamReader
        except ImportError as e:
            hint = "; run: pip install 'foreshock[zenoh]'"
            raise MissingExtraError("journal", f"{e.name} is not installed", hint) from e
        self.at = 0
        with self.path.open("rb") as file:
            try:
                for record in StreamReader(file, validate_crcs=True).records:
                    self.at = file.tell()
                    yield record
            except InvalidMagic:
                if not self.at:
                    raise BadInputError(str(self.path), "is no MCAP file") from None
            except Exception as e:  # noqa: BLE001 # damaged bytes make the reader raise anything
                if not self.at:
                    raise BadInputError(str(self.path), "ends before the first record of an MCAP file") from None
                file.seek(self.at)
                frame = file.read(9)
                if len(frame) == 9 and self.at + 9 + int.from_bytes(frame[1:], "little") <= self.size:
                    raise DamagedError(self.path, f"is damaged at byte {self.at}: {type(e).__name__}: {e}") from None
