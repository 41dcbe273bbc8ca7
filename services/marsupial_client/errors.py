"""The exceptions of the client, in one tree.

::

    ClientError             raised itself for an event whose data is not JSON
    ├── ProxyUnusable       the environment names a proxy that can't be used
    ├── Unreachable         no connection or no complete answer, for longer than the client's patience
    └── Refused             the service answered with a problem (RFC 9457)
        ├── Invalid             400, 422: the request is invalid; `errors` say where
        ├── KeyRefused          401, 403: a key is missing or doesn't allow this
        ├── NotFound            404
        ├── Conflict            409: the request contradicts an earlier one
        ├── TooLarge            413
        ├── ServiceFailed       500: a bug of the service
        └── Busy                408, 429, 502, 503, 504, 507, for longer than the client's patience
"""

import json
from collections.abc import Mapping
from typing import Any

from marsupial_client.documents import Problem, ProblemDetail


class ClientError(Exception):
    """Any error of the client."""


class ProxyUnusable(ClientError):
    """The environment names a proxy that can't be used; the text says which variable, and what to do."""


class Unreachable(ClientError):
    """The service can't be reached; `__cause__` says what broke last."""


class Refused(ClientError):
    """The service refused the request: `problem` is the document in its answer, or one made from any other answer.

    `status` is the HTTP status, `type` the kind of problem (``urn:marsupial:problem:invalid``), `detail` a
    line that says what is wrong, and `errors` has every mistake in a request with a JSON pointer into the body or the
    name of a parameter. `retry_after_s` are the seconds to wait before another attempt, if the service says so.
    """

    def __init__(self, problem: Problem, retry_after_s: float | None = None) -> None:
        self.problem = problem
        self.retry_after_s = retry_after_s
        self.status: int = problem["status"]
        self.type: str = problem["type"]
        self.detail: str = problem["detail"]
        self.errors: tuple[ProblemDetail, ...] = tuple(problem.get("errors", ()))
        words = []
        for error in self.errors:
            place = error.get("pointer") or error.get("query") or error.get("header") or error.get("path")
            words.append(f"{place}: {error['detail']}" if place else error["detail"])
        super().__init__(f"the service refused the request ({self.status}): {'; '.join(words) or self.detail}")


class Invalid(Refused):
    """The request is invalid by itself."""


class KeyRefused(Refused):
    """The API key is missing, unknown or does not allow this."""


class NotFound(Refused):
    """The job, mission or page does not exist."""


class Conflict(Refused):
    """The request contradicts an earlier one."""


class TooLarge(Refused):
    """The request is larger than the service accepts."""


class ServiceFailed(Refused):
    """The service failed because of a bug."""


class Busy(Refused):
    """The service, or a proxy in front of it, can't do this now, but may later."""


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
"""The exception for each status; others are `Refused`. Proxies answer 502 and 504 while a server is down."""


def refusal(status: int, text: str, path: str, retry_after: str | None, sender: str = "") -> Refused:
    """Return the exception for an answer with the body `text` that did not succeed; `sender` may have sent it."""
    # a date in that header is ignored: it comes from a proxy, whose clock may differ from ours
    retry_after_s = float(retry_after) if retry_after is not None and retry_after.strip().isdecimal() else None
    return REFUSALS.get(status, Refused)(_problem(status, text, path, sender), retry_after_s)


def _problem(status: int, text: str, path: str, sender: str) -> Problem:
    unknown: Problem = {
        "type": "about:blank",
        "title": "The answer is not a problem document",
        "status": status,
        "detail": (text[:200] or "no details") + (f" (perhaps by {sender})" if sender else ""),
        "instance": path,
    }
    try:
        found = json.loads(text)
    except (ValueError, RecursionError):
        return unknown
    return {**unknown, **found} if _is_problem(found, status) else unknown


def _is_problem(found: Any, status: int) -> bool:
    """Return whether an answer is a problem document: proxies answer in JSON too."""
    if not isinstance(found, dict) or not isinstance(found.get("detail"), str) or found.get("status") != status:
        return False
    errors = found.get("errors", [])
    return isinstance(errors, list) and all(isinstance(e, dict) and isinstance(e.get("detail"), str) for e in errors)
