"""What the client raises, in one tree.

::

    ClientError             also itself: an event whose data is not JSON
    ├── Unreachable         no connection or no whole answer, for longer than the client's patience
    └── Refused             the service answered with a problem (RFC 9457)
        ├── Invalid             400, 422: what was sent can't be right; `errors` point at what
        ├── KeyRefused          401, 403: a key is missing, or doesn't allow this
        ├── NotFound            404
        ├── Conflict            409: what was sent contradicts what is known
        ├── TooLarge            413
        ├── ServiceFailed       500: a bug of the service
        └── Busy                408, 429, 502, 503, 504, 507, for longer than the client's patience
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from typing import Any

from marsupial_client.documents import Problem, ProblemDetail


class ClientError(Exception):
    """Root of the tree."""


class Unreachable(ClientError):
    """The service can't be reached; `__cause__` says what broke last."""


class Refused(ClientError):
    """The service refuses.

    Attributes
    ----------
    problem
        The document that was answered; of what is no problem document, one that says as much.
    retry_after_s
        After how many seconds another try may go better, where the service says so.
    """

    def __init__(self, problem: Problem, retry_after_s: float | None = None) -> None:
        words = "; ".join(f"{_place(error)}{error['detail']}" for error in problem.get("errors", ()))
        super().__init__(f"the service refuses ({problem['status']}): {words or problem['detail']}")
        self.problem = problem
        self.retry_after_s = retry_after_s

    @property
    def status(self) -> int:
        """The status of HTTP."""
        return self.problem["status"]

    @property
    def type(self) -> str:
        """Which kind of problem, like ``urn:marsupial:problem:invalid``."""
        return self.problem["type"]

    @property
    def detail(self) -> str:
        """What is wrong, in a line."""
        return self.problem["detail"]

    @property
    def errors(self) -> tuple[ProblemDetail, ...]:
        """All that is wrong in a request, each with a JSON pointer into the body or the name of a parameter."""
        return tuple(self.problem.get("errors", ()))


class Invalid(Refused):
    """What was sent can't be right, whatever is known."""


class KeyRefused(Refused):
    """The API key is missing, unknown, or does not allow this."""


class NotFound(Refused):
    """There is no such job, mission or page."""


class Conflict(Refused):
    """What was sent contradicts what was sent before."""


class TooLarge(Refused):
    """The request is larger than the service takes."""


class ServiceFailed(Refused):
    """Something went wrong in the service."""


class Busy(Refused):
    """The service, or a proxy before it, can't do this now, but may later."""


REFUSALS: Mapping[int, type[Refused]] = {
    400: Invalid,
    401: KeyRefused,
    403: KeyRefused,
    404: NotFound,
    408: Busy,
    409: Conflict,
    413: TooLarge,
    422: Invalid,
    429: Busy,
    500: ServiceFailed,
    502: Busy,
    503: Busy,
    504: Busy,
    507: Busy,
}
"""What each status is raised as; any other is plainly `Refused`. Proxies answer 502 and 504 while a server is away."""


def refusal(status: int, text: str, path: str, retry_after: str | None) -> Refused:
    """Return the exception for an answer that is none of success; `text` is its body."""
    return REFUSALS.get(status, Refused)(_problem(status, text, path), _seconds(retry_after))


def _problem(status: int, text: str, path: str) -> Problem:
    plain: Problem = {
        "type": "about:blank",
        "title": "The answer is no problem document",
        "status": status,
        "detail": text[:200] or "nothing is said",
        "instance": path,
    }
    try:
        told = json.loads(text)
    except (ValueError, RecursionError):
        return plain
    return {**plain, **told} if _is_problem(told, status) else plain


def _is_problem(told: Any, status: int) -> bool:
    """Say whether an answer is a problem document: proxies answer in JSON too."""
    if not isinstance(told, dict) or not isinstance(told.get("detail"), str) or told.get("status") != status:
        return False
    errors = told.get("errors", [])
    return isinstance(errors, list) and all(isinstance(e, dict) and isinstance(e.get("detail"), str) for e in errors)


def _seconds(retry_after: str | None) -> float | None:
    """Read the header, which may also be a date: that of a proxy, whose clock is not ours, so it is passed over."""
    return float(retry_after) if retry_after is not None and retry_after.strip().isdecimal() else None


def _place(error: ProblemDetail) -> str:
    place = error.get("pointer") or error.get("query") or error.get("header") or error.get("path")
    return f"{place}: " if place else ""
