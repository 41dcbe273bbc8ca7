"""Every error as ``application/problem+json`` (RFC 9457), with pointers to what is wrong in the request.

`KINDS` lists what can go wrong at the rim, `ERROR_KINDS` what each exception of the library becomes there.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from http import HTTPStatus

from pydantic import ValidationError
from pydantic_core import ErrorDetails
from starlette.responses import Response

from marsupial import errors as library
from marsupial.errors import InputError, MarsupialError, Problem
from marsupial_service.http.pointers import of_location, of_path
from marsupial_service.schemas.answers import ProblemAnswer, ProblemDetailAnswer
from marsupial_service.schemas.base import NONE_OF

MEDIA_TYPE = "application/problem+json"


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of error: HTTP status and title; clients know it by ``urn:marsupial:problem:<name>``."""

    status: int
    title: str


KINDS: Mapping[str, Kind] = {
    "bad-request": Kind(400, "The request is not valid HTTP"),
    "bad-json": Kind(400, "The body is not valid JSON"),
    "no-key": Kind(401, "An API key is needed"),
    "no-scope": Kind(403, "The API key does not allow this"),
    "cross-origin": Kind(403, "The request was sent by a page of another origin"),
    "not-found": Kind(404, "Not found"),
    "no-method": Kind(405, "The method is not allowed here"),
    "not-acceptable": Kind(406, "The answer is not available in that format"),
    "conflict": Kind(409, "The request contradicts what is known"),
    "too-slow": Kind(408, "The body did not arrive in time"),
    "too-large": Kind(413, "The request is too large"),
    "media-type": Kind(415, "The body has to be JSON"),
    "misdirected": Kind(421, "The request is for another host"),
    "invalid": Kind(422, "The request is not valid"),
    "key-reused": Kind(422, "The idempotency key was used for another request"),
    "too-many": Kind(429, "Too many at a time"),
    "internal": Kind(500, "Something went wrong in the service"),
    "not-ready": Kind(503, "The service is not ready"),
    "store-full": Kind(507, "The store is full"),
}

ERROR_KINDS: Mapping[type[MarsupialError], str] = {
    library.InputError: "invalid",
    library.MapError: "invalid",
    library.ScenarioError: "invalid",
    library.SituationError: "invalid",
    library.PlanTextError: "invalid",
    library.LogError: "invalid",
    library.UsageError: "invalid",
    library.EngineUnavailable: "invalid",
    library.InvalidPlanError: "invalid",
    library.InternalError: "internal",
}


class HttpProblem(Exception):
    """An error to be answered.

    Parameters
    ----------
    kind
        One of `KINDS`.
    """

    def __init__(
        self,
        kind: str,
        detail: str = "",
        *,
        errors: Iterable[ProblemDetailAnswer] = (),
        headers: Mapping[str, str] | None = None,
    ) -> None:
        super().__init__(detail)
        self.kind = kind
        self.title = KINDS[kind].title
        self.detail = detail
        self.errors = tuple(errors)
        self.headers = dict(headers or {})

    def __reduce__(self) -> tuple[object, ...]:
        """Say how it is sent from another process."""
        return partial(HttpProblem, errors=self.errors, headers=self.headers), (self.kind, self.detail)


MOST_ERRORS = 100
"""No answer lists more."""


def answer(problem: HttpProblem, instance: str) -> Response:
    """Return the response for a problem with the request for the path `instance`."""
    kind = KINDS[problem.kind]
    errors = problem.errors[:MOST_ERRORS]
    body = ProblemAnswer(
        type=f"urn:marsupial:problem:{problem.kind}",
        title=kind.title,
        status=kind.status,
        detail=problem.detail or summary(errors, len(problem.errors)) or _described(kind),
        instance=instance,
        errors=list(errors) or None,
    )
    text = json.dumps(body.model_dump())
    return Response(text.encode(), status_code=kind.status, headers=problem.headers, media_type=MEDIA_TYPE)


def _described(kind: Kind) -> str:
    return HTTPStatus(kind.status).description or kind.title


def summary(errors: Sequence[ProblemDetailAnswer], count: int) -> str:
    """Return the first of `count` errors in a line, and how many more there are."""
    if not errors:
        return ""
    first = errors[0]
    more = f" (and {count - 1} more)" if count > 1 else ""
    return f"{first.pointer or first.query or first.header or first.path or 'the body'}: {first.detail}{more}"


def problem_of(error: MarsupialError, document: object) -> HttpProblem:
    """Return the problem for what the library raises about input, which is the body `document`.

    What is not the client's fault is raised again.
    """
    kind = kind_of(error)
    if KINDS[kind].status >= 500:
        raise error
    if not isinstance(error, InputError):
        return HttpProblem(kind, str(error))
    return problem_of_all(kind, error.problems, document)


def problem_of_all(kind: str, problems: Sequence[Problem], document: object) -> HttpProblem:
    """Return the problem for all that is wrong with the body `document`; the first ones are told."""
    details = [
        ProblemDetailAnswer(pointer=of_path(problem.path, document), detail=problem.message)
        for problem in problems[:MOST_ERRORS]
    ]
    return HttpProblem(kind, summary(details, len(problems)), errors=details)


def problem_of_shape(error: ValidationError, document: object) -> HttpProblem:
    """Return the problem for what pydantic finds wrong in the body `document`."""
    found = error.errors(include_url=False, include_input=False)
    details = [
        ProblemDetailAnswer(pointer=of_location(_place(one), document), detail=one["msg"])
        for one in found[:MOST_ERRORS]
    ]
    return HttpProblem("invalid", summary(details, len(found)), errors=details)


def _place(error: ErrorDetails) -> tuple[str | int, ...]:
    """Return what an error of pydantic's is about: where one of several fields is needed, the likeliest of them."""
    if error["type"] == NONE_OF:
        return (*error["loc"], error["ctx"]["keys"].split()[0])
    return error["loc"]


def kind_of(error: MarsupialError) -> str:
    """Return the kind of an exception of the library."""
    return next(ERROR_KINDS[cls] for cls in type(error).__mro__ if cls in ERROR_KINDS)
