"""Journals in MCAP files: a killed process loses nothing that was flushed; what is there replays exactly."""

from foreshock.recording._format import DECISION, END, RESET, TICK, End, Head, TickRecord
from foreshock.recording._read import JournalFile, Tick, is_journal
from foreshock.recording._records import DamagedError, Records
from foreshock.recording._recover import Summary, recover, summary
from foreshock.recording._write import McapJournal, check_writable

__all__ = [
    "DECISION",
    "END",
    "RESET",
    "TICK",
    "DamagedError",
    "End",
    "Head",
    "JournalFile",
    "McapJournal",
    "Records",
    "Summary",
    "Tick",
    "TickRecord",
    "check_writable",
    "is_journal",
    "recover",
    "summary",
]
