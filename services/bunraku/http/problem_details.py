"""Problem documents (RFC 9457): the error responses of the HTTP API."""

from __future__ import annotations

import contextlib
import errno
import logging
from collections.abc import Iterator
from http import HTTPStatus
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from starlette.exceptions import HTTPException

from bunraku.http import request_id
from bunraku.runtime.availability import BackendUnavailable

MEDIA_TYPE = "application/problem+json"
RETRY_AFTER_S = 2
"""Value of `Retry-After` in responses about an unavailable backend, in seconds."""
_DISK_FULL_ERRNOS = (errno.ENOSPC, errno.EDQUOT)

_log = logging.getLogger(__name__)


class ProblemError(Exception):
    """Error that is answered with a problem document.

    `title` names the kind of problem and `detail` describes this occurrence. `extra` has further members of the
    document, such as `field`, `hint` or `line`; members that are None are omitted.
    """

    def __init__(self, status: int, title: str, detail: str, **extra: Any) -> None:
        super().__init__(detail)
        self.status = status
        self.title = title
        self.detail = detail
        self.extra = extra

    def to_dict(self) -> dict[str, Any]:
        """Return plain values for a message on the bus. `from_dict` is the inverse."""
        extra = {name: value for name, value in self.extra.items() if value is not None}
        return {"status": self.status, "title": self.title, "detail": self.detail, **extra}

    @classmethod
    def from_dict(cls, values: dict[str, Any]) -> ProblemError:
        """Return the problem that another service reported on the bus."""
        return cls(**values)


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


def insufficient_storage(resource: str) -> ProblemError:
    """Return the problem for a request that a full disk or quota prevents."""
    return ProblemError(
        507,
        "No room left",
        f"{resource} has no space left; nothing was stored",
        hint="remove motions, or provide more storage",
    )


def is_disk_full(error: BaseException) -> bool:
    """Return whether an error means that a disk or quota is full.

    Accepts OSError and errors of libraries that mention the error number in their message only.
    """
    if isinstance(error, OSError) and error.errno is not None:
        return error.errno in _DISK_FULL_ERRNOS
    return any(f"os error {number})" in str(error) for number in _DISK_FULL_ERRNOS)


@contextlib.contextmanager
def translate_disk_full(resource: str) -> Iterator[None]:
    """Raise `insufficient_storage` instead of an OSError about a full disk or quota."""
    try:
        yield
    except OSError as error:
        if is_disk_full(error):
            raise insufficient_storage(resource) from error
        raise


def problem_response(problem: ProblemError, headers: dict[str, str] | None = None) -> JSONResponse:
    """Return the HTTP response for a problem. Its `request_id` identifies the request in the logs."""
    body = {"type": "about:blank", **problem.to_dict()}
    if request := request_id.current():
        body["request_id"] = request
    return JSONResponse(body, problem.status, headers, MEDIA_TYPE)


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
        # the rest of a body that is too large is not read
        too_large = error.status == HTTPStatus.REQUEST_ENTITY_TOO_LARGE
        return problem_response(error, {"Connection": "close"} if too_large else None)

    @app.exception_handler(BackendUnavailable)
    async def answer_unavailable(request: Request, error: BackendUnavailable) -> JSONResponse:
        _log.warning("%s %s: %s", request.method, request.url.path, error)
        return unavailable_response(error)

    @app.exception_handler(RequestValidationError)
    async def answer_invalid_request(_: Request, error: RequestValidationError) -> JSONResponse:
        first = error.errors()[0]
        return problem_response(invalid_field_problem(first["loc"][1:], first["msg"]))

    @app.exception_handler(HTTPException)
    async def answer_http_exception(request: Request, error: HTTPException) -> JSONResponse:
        title = HTTPStatus(error.status_code).phrase
        detail = f"{request.method} {request.url.path}: {error.detail}"
        return problem_response(ProblemError(error.status_code, title, detail), dict(error.headers or {}))
