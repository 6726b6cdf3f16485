"""RFC 9457 problem documents: what HTTP answers when something is wrong."""

from __future__ import annotations

import logging
from http import HTTPStatus
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from starlette.exceptions import HTTPException

from bunraku.runtime import request_id
from bunraku.runtime.availability import BackendUnavailable
from bunraku.runtime.problem import ProblemError as ProblemError

MEDIA_TYPE = "application/problem+json"
RETRY_AFTER_S = 2
"""Seconds after which a request that could not be served is worth another try."""

_log = logging.getLogger(__name__)


def problem_response(problem: ProblemError, headers: dict[str, str] | None = None) -> JSONResponse:
    """The problem as HTTP says it, with the name under which the logs have the request; fields that are None are left
    out."""
    body = {"type": "about:blank", **problem.to_dict()}
    if request := request_id.current():
        body["request_id"] = request
    return JSONResponse(body, problem.status, headers, MEDIA_TYPE)


def unavailable_response(error: BackendUnavailable) -> JSONResponse:
    """The answer while something is away."""
    detail = f"{error.backend} does not answer now; nothing is lost by sending the request again"
    problem = ProblemError(503, "Not available now", detail, hint="try again in a while")
    return problem_response(problem, {"Retry-After": str(RETRY_AFTER_S)})


def install_problem_handlers(app: FastAPI) -> None:
    """Makes every error that `app` answers a problem document."""

    @app.exception_handler(ProblemError)
    async def told(_: Request, error: ProblemError) -> JSONResponse:
        # what else comes of a body that is too large is not wanted
        return problem_response(
            error, {"Connection": "close"} if error.status == HTTPStatus.REQUEST_ENTITY_TOO_LARGE else None
        )

    @app.exception_handler(BackendUnavailable)
    async def away(request: Request, error: BackendUnavailable) -> JSONResponse:
        _log.warning("%s %s: %s", request.method, request.url.path, error)
        return unavailable_response(error)

    @app.exception_handler(RequestValidationError)
    async def invalid(_: Request, error: RequestValidationError) -> JSONResponse:
        first = error.errors()[0]
        return problem_response(invalid_field_problem(first["loc"][1:], first["msg"]))

    @app.exception_handler(HTTPException)
    async def refused(request: Request, error: HTTPException) -> JSONResponse:
        title = HTTPStatus(error.status_code).phrase
        detail = f"{request.method} {request.url.path}: {error.detail}"
        return problem_response(ProblemError(error.status_code, title, detail), dict(error.headers or {}))


def invalid_field_problem(location: tuple[int | str, ...], message: str) -> ProblemError:
    """The problem of one field of a request, at `location` as pydantic gives it: `("targets", 3, 1)`."""
    field = "".join(f"[{part}]" if isinstance(part, int) else f".{part}" for part in location).lstrip(".")
    return ProblemError(422, "Invalid request", f"{field}: {message}" if field else message, field=field or None)
