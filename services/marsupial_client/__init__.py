"""The client of marsupial's HTTP service: plans and missions for your own robots.

::

    from marsupial_client import Client

    with Client("http://127.0.0.1:8080") as client:
        job = client.submit(client.demo("office-2x2"))
        for plan in job.plans():  # each better than the one before
            print(plan["makespan_ms"])

The client retries whatever fails, and nothing is lost or done twice: each job and mission is sent with its own key,
reports are numbered and sent until they are acknowledged, streams resume after the last event received.
`AsyncClient` is the same for asyncio. Requests and answers are typed dicts of the service's JSON
(`marsupial_client.documents` and `mission_documents`); refusals are exceptions (`marsupial_client.errors`).
"""

from marsupial_client.async_client import AsyncClient, AsyncJob, AsyncMission
from marsupial_client.blocking_client import Client, Job, Mission
from marsupial_client.errors import (
    Busy,
    ClientError,
    Conflict,
    Invalid,
    KeyRefused,
    NotFound,
    ProxyUnusable,
    Refused,
    ServiceFailed,
    TooLarge,
    Unreachable,
)
from marsupial_client.events import Event, JobEvent, MissionEvent

__version__ = "0.1.0"

__all__ = [
    "AsyncClient",
    "AsyncJob",
    "AsyncMission",
    "Busy",
    "Client",
    "ClientError",
    "Conflict",
    "Event",
    "Invalid",
    "Job",
    "JobEvent",
    "KeyRefused",
    "Mission",
    "MissionEvent",
    "NotFound",
    "ProxyUnusable",
    "Refused",
    "ServiceFailed",
    "TooLarge",
    "Unreachable",
]
