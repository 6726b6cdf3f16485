"""Problem documents for errors that no handler expects."""

from __future__ import annotations

import errno
import logging

from starlette.requests import ClientDisconnect
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from bunraku.http.problem_details import RETRY_AFTER_S, problem_response
from bunraku.runtime.insufficient_storage import insufficient_storage, is_disk_full
from bunraku.runtime.problem import ProblemError

_STORAGE_ERRNOS = (errno.EROFS, errno.EACCES, errno.EPERM, errno.EIO, errno.EMFILE, errno.ENFILE)
"""Errors of a file system that is read-only, not accessible or damaged, and of a process with too many open files."""

_log = logging.getLogger(__name__)


class UnhandledErrorMiddleware:
    """Middleware that answers an unexpected exception with a problem document and logs its traceback once.

    After the start of a response the connection is closed instead. A request whose client has disconnected gets no
    response and is no error.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] != "http":
            await self._app(scope, receive, send)
            return
        is_started = False

        async def send_and_note_start(message: Message) -> None:
            nonlocal is_started
            is_started = is_started or message["type"] == "http.response.start"
            await send(message)

        try:
            await self._app(scope, receive, send_and_note_start)
        except ClientDisconnect:
            return
        except Exception as error:
            # returning without a complete response makes the server close the connection
            _log.exception("%s %s failed", scope["method"], scope["path"])
            if not is_started:
                problem = _problem_of(error)
                headers = {"Retry-After": str(RETRY_AFTER_S)} if problem.status == 503 else None
                await problem_response(problem, headers)(scope, receive, send)


def _problem_of(error: Exception) -> ProblemError:
    """Return the problem for an exception, without its text, which may contain paths and addresses."""
    if is_disk_full(error):
        return insufficient_storage("this server")
    if isinstance(error, OSError) and error.errno in _STORAGE_ERRNOS:
        return ProblemError(
            503,
            "Not available now",
            "this server cannot use its files now; it is safe to send the request again",
            hint="try again later; the operator finds the reason in the log",
        )
    return ProblemError(
        500,
        "Internal error",
        "this server failed to answer the request",
        hint="please report it with the request id",
    )
