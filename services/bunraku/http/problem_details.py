"""Problem documents (RFC 9457): the error responses of the HTTP API."""

from __future__ import annotations

import logging
from http import HTTPStatus

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from pydantic import ValidationError
from starlette.exceptions import HTTPException

from bunraku.runtime import request_id
from bunraku.runtime.availability import BackendUnavailable
from bunraku.runtime.display_text import MAX_PROBLEM_CHARACTERS, clean_document
from bunraku.runtime.problem import ProblemError

MEDIA_TYPE = "application/problem+json"
RETRY_AFTER_S = 2
"""Value of `Retry-After` in responses about an unavailable backend, in seconds."""

_PROBLEM_HEADERS: dict[int, dict[str, str]] = {
    # the rest of a body that is too large is not read
    HTTPStatus.REQUEST_ENTITY_TOO_LARGE: {"Connection": "close"},
    HTTPStatus.SERVICE_UNAVAILABLE: {"Retry-After": str(RETRY_AFTER_S)},
}

_log = logging.getLogger(__name__)


def motion_not_found(motion_id: str) -> ProblemError:
    """Return the problem for a motion that does not exist, or that the client may not see."""
    return ProblemError(
        404, "No such motion", f"there is no motion {motion_id[:40]!r}", hint="GET /v1/motions lists the motions"
    )


def session_not_found(session_id: str) -> ProblemError:
    """Return the problem for a session that does not exist, or that the client may not see."""
    return ProblemError(404, "No such session", f"there is no session {session_id[:40]!r}")


def invalid_field_problem(location: tuple[int | str, ...], message: str) -> ProblemError:
    """Return the problem for one field of a request.

    `location` is the path to the field as in pydantic's errors, for example `("targets", 3, 1)`.
    """
    field = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in location).lstrip(".")
    return ProblemError(422, "Invalid request", f"{field}: {message}" if field else message, field=field or None)


def validation_problem(error: ValidationError) -> ProblemError:
    """Return the problem for the first error that pydantic has found in a request."""
    first = error.errors(include_url=False)[0]
    return _invalid_value_problem(first["loc"], first["msg"])


def _invalid_value_problem(location: tuple[int | str, ...], message: str) -> ProblemError:
    """Return the problem for an error of pydantic, without its marks for keys of mappings and for our own checks."""
    path = location[:-1] if location[-1:] == ("[key]",) else location
    return invalid_field_problem(path, message.removeprefix("Value error, "))


def problem_response(problem: ProblemError, headers: dict[str, str] | None = None) -> JSONResponse:
    """Return the HTTP response for a problem. Its `request_id` identifies the request in the logs.

    Its texts may quote the request or an uploaded file: they are cleaned as names are. It is never cached.
    """
    body = {"type": "about:blank", **clean_document(problem.to_dict(), MAX_PROBLEM_CHARACTERS)}
    if request := request_id.current():
        body["request_id"] = request
    retry = {"Retry-After": "1"} if problem.status == HTTPStatus.TOO_MANY_REQUESTS else {}
    return JSONResponse(body, problem.status, {"Cache-Control": "no-store", **retry, **(headers or {})}, MEDIA_TYPE)


def unavailable_response(error: BackendUnavailable) -> JSONResponse:
    """Return the HTTP response for a request that needs an unavailable backend."""
    problem = ProblemError(
        503,
        "Not available now",
        f"{error.backend} is unavailable; it is safe to send the request again",
        hint="try again in a few seconds",
    )
    return problem_response(problem, {"Retry-After": str(RETRY_AFTER_S)})


def install_problem_handlers(app: FastAPI) -> None:
    """Answer every error of `app` with a problem document."""

    @app.exception_handler(ProblemError)
    async def answer_problem(_: Request, error: ProblemError) -> JSONResponse:
        return problem_response(error, _PROBLEM_HEADERS.get(error.status))

    @app.exception_handler(BackendUnavailable)
    async def answer_unavailable(request: Request, error: BackendUnavailable) -> JSONResponse:
        _log.warning("%s %s: %s", request.method, request.url.path, error)
        return unavailable_response(error)

    @app.exception_handler(RequestValidationError)
    async def answer_invalid_request(_: Request, error: RequestValidationError) -> JSONResponse:
        first = error.errors()[0]
        return problem_response(_invalid_value_problem(first["loc"][1:], first["msg"]))

    @app.exception_handler(HTTPException)
    async def answer_http_exception(request: Request, error: HTTPException) -> JSONResponse:
        title = HTTPStatus(error.status_code).phrase
        detail = f"{request.method} {request.url.path}: {error.detail}"
        return problem_response(ProblemError(error.status_code, title, detail), dict(error.headers or {}))
