"""Journals in MCAP files: a killed process loses nothing that was flushed; what is there replays exactly."""

from foreshock.recording._format import DECISION, RESET, TICK, Head, TickRecord
from foreshock.recording._read import JournalFile, Tick, is_journal, records_of
from foreshock.recording._recover import Summary, recover, summary
from foreshock.recording._write import McapJournal

__all__ = [
    "DECISION",
    "RESET",
    "TICK",
    "Head",
    "JournalFile",
    "McapJournal",
    "Summary",
    "Tick",
    "TickRecord",
    "is_journal",
    "records_of",
    "recover",
    "summary",
]
