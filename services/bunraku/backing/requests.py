"""Every request and every socket as it comes and goes: its name, its time, a line of the log, and a number."""

from __future__ import annotations

import logging
import time
from http import HTTPMethod

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from bunraku.backing import request_id
from bunraku.backing.metrics import Distributions, Metrics
from bunraku.backing.request_id import HEADER

ROUTE = "bunraku.route"
"""Under which the guard puts the route's own path, `/v1/motions/{motion}`, into the scope."""
API = "/v1/"
ELSEWHERE = "elsewhere"
"""In place of a route, for paths of the API that no route has."""
PAGE = "page"
"""In place of one, for the page and its files."""
SOCKET = "WEBSOCKET"
"""In place of a method."""
QUIET = ("/livez", "/readyz", "/v1/health")
"""What is asked every few seconds, to see whether somebody answers."""

_METHODS = frozenset(HTTPMethod)
_log = logging.getLogger(__name__)


class Requests:
    """Stands before all else. A socket counts when it is shaken hands with, or refused; how it ends is told where it
    does."""

    def __init__(self, app: ASGIApp, metrics: Metrics) -> None:
        self._app = app
        self._times = Distributions()
        metrics.distributions(
            "request_duration_seconds",
            "Requests by route, method and status, and how long they took; sockets until their handshake",
            self._times,
            ("route", "method", "status"),
        )

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """As ASGI has it."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        request = request_id.taken(Headers(scope=scope).getlist(HEADER))
        method, begun, said = scope.get("method", SOCKET), time.perf_counter(), False

        def done(status: int) -> None:
            nonlocal said
            if not said:
                said = True
                self._tell(scope, method, status, time.perf_counter() - begun)

        # of one who went away before an answer began, as proxies have it
        status = 499

        async def sending(message: Message) -> None:
            nonlocal status
            kind = message["type"]
            if kind in ("http.response.start", "websocket.http.response.start"):
                status = message["status"]
                MutableHeaders(raw=_headers(message))[HEADER] = request
            elif kind == "websocket.accept":
                # the name is not in the handshake: a narrow line takes 15 ms for it, before the first block
                status = 101
            elif kind == "websocket.close":
                # before the handshake it is a 403
                status = 403 if status == 499 else status
            await send(message)
            if scope["type"] == "websocket":
                done(status)

        with request_id.at_work(request):
            try:
                await self._app(scope, receive, sending)
            except Exception:
                status = 500
                raise
            finally:
                done(status)

    def _tell(self, scope: Scope, method: str, status: int, seconds: float) -> None:
        path: str = scope["path"]
        route = scope.get(ROUTE) or (path if path in QUIET else ELSEWHERE if path.startswith(API) else PAGE)
        known = method if method in _METHODS or method == SOCKET else "OTHER"
        self._times.add((route, known, str(status)), seconds)
        level = logging.DEBUG if path in QUIET else logging.INFO
        if _log.isEnabledFor(level):
            told = {"method": method, "route": route, "path": path, "status": status, "seconds": round(seconds, 6)}
            _log.log(level, "request", extra=told)


def _headers(message: Message) -> list[tuple[bytes, bytes]]:
    found: list[tuple[bytes, bytes]] = list(message.get("headers", ()))
    message["headers"] = found
    return found
