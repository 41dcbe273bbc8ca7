"""Read jobs from a snapshot of the store."""

import zlib

from marsupial.model.planning import Budget
from marsupial_service.entries.documents import line, text_with
from marsupial_service.entries.records import UnknownEntry
from marsupial_service.entries.table import EntryTable, record_of
from marsupial_service.jobs.records import TRANSITIONS, Analysed, JobRecord
from marsupial_service.schemas.enums import JobEventType, JobOutcome, JobState
from marsupial_service.store.engine import StoreRow
from marsupial_service.store.transaction import StoreReader
from marsupial_service.timestamps import timestamp

_SELECT = """
SELECT jobs.*, plans.makespan_ms
FROM jobs LEFT JOIN plans ON plans.job = jobs.number AND plans.revision = jobs.plans"""


def plan_text(reader: StoreReader, job: str, revision: int) -> str:
    """Return a revision of a job's plan as JSON, without parsing its actions. Raises UnknownEntry."""
    sql = "SELECT plans.* FROM plans JOIN jobs ON number = job WHERE id = ? AND revision = ?"
    row = reader.execute(sql, (job, revision)).fetchone()
    if row is None:
        raise UnknownEntry("job")
    words = {name: row[name] for name in ("revision", "makespan_ms", "found_after_ms")}
    return text_with({**words, "found_at": timestamp(row["at_ms"])}, actions=row["actions"], ipc=line(row["ipc"]))


def analysis(reader: StoreReader, job: str) -> Analysed | None:
    """Return the analysis of a job's map; None until it is stored, and for jobs sent with a situation."""
    sql = "SELECT situation, places FROM payloads JOIN jobs ON number = job WHERE id = ? AND situation IS NOT NULL"
    row = reader.execute(sql, (job,)).fetchone()
    return None if row is None else Analysed(situation=row["situation"], places=row["places"])


def source_text(reader: StoreReader, job: str) -> str | None:
    """Return the JSON text that the client sent for a job."""
    sql = "SELECT source FROM payloads JOIN jobs ON number = job WHERE id = ?"
    row = reader.execute(sql, (job,)).fetchone()
    return None if row is None else zlib.decompress(row["source"]).decode()


def _job(row: StoreRow) -> JobRecord:
    return record_of(
        JobRecord,
        row,
        state=JobState(row["state"]),
        outcome=None if row["outcome"] is None else JobOutcome(row["outcome"]),
        budget=Budget(seconds=row["seconds"], steps=row["steps"]),
    )


JOBS = EntryTable(
    name="jobs",
    events_name="events",
    noun="job",
    select=_SELECT,
    record=_job,
    event_type=JobEventType,
    transitions=TRANSITIONS,
)
"""The table of jobs."""
