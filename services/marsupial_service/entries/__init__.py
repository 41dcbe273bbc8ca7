"""What jobs and missions share: entries of the store.

An entry is made once under an idempotency key, stored before it is acknowledged, seen by its owner only, followed event
by event, and removed when it is old. What a job or a mission does beyond that is said in its own package.
"""

from marsupial_service.entries.records import (
    Created,
    Entry,
    EntrySettings,
    EventRecord,
    KeyReused,
    NewEntry,
    TooMany,
    UnknownEntry,
)
from marsupial_service.entries.service import Entries
from marsupial_service.entries.table import EntryTable, Reader

__all__ = [
    "Created",
    "Entries",
    "Entry",
    "EntrySettings",
    "EntryTable",
    "EventRecord",
    "KeyReused",
    "NewEntry",
    "Reader",
    "TooMany",
    "UnknownEntry",
]
