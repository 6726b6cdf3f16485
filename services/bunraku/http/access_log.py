"""Every request and every socket as it comes and goes: its name, its time, a line of the log, and a number."""

from __future__ import annotations

import logging
import time
from http import HTTPMethod

from starlette.datastructures import Headers, MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from bunraku.runtime import request_id
from bunraku.runtime.metrics import LabelledHistograms, Metrics
from bunraku.runtime.request_id import REQUEST_ID_HEADER

ROUTE_SCOPE_KEY = "bunraku.route"
"""Under which the guard puts the route's own path, `/v1/motions/{motion}`, into the scope."""
API_PREFIX = "/v1/"
UNKNOWN_ROUTE = "elsewhere"
"""In place of a route, for paths of the API that no route has."""
PAGE_ROUTE = "page"
"""In place of one, for the page and its files."""
WEBSOCKET_METHOD = "WEBSOCKET"
"""In place of a method."""
PROBE_PATHS = ("/livez", "/readyz", "/v1/health")
"""What is asked every few seconds, to see whether somebody answers."""

_KNOWN_METHODS = frozenset(HTTPMethod)
_log = logging.getLogger(__name__)


class AccessLogMiddleware:
    """Stands before all else. A socket counts when it is shaken hands with, or refused; how it ends is told where it
    does."""

    def __init__(self, app: ASGIApp, metrics: Metrics) -> None:
        self._app = app
        self._durations = LabelledHistograms()
        metrics.histograms(
            "request_duration_seconds",
            "Requests by route, method and status, and how long they took; sockets until their handshake",
            self._durations,
            ("route", "method", "status"),
        )

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """As ASGI has it."""
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        request = request_id.accept_or_generate(Headers(scope=scope).getlist(REQUEST_ID_HEADER))
        method, begun, said = scope.get("method", WEBSOCKET_METHOD), time.perf_counter(), False

        def done(status: int) -> None:
            nonlocal said
            if not said:
                said = True
                self._record(scope, method, status, time.perf_counter() - begun)

        # of one who went away before an answer began, as proxies have it
        status = 499

        async def sending(message: Message) -> None:
            nonlocal status
            kind = message["type"]
            if kind in ("http.response.start", "websocket.http.response.start"):
                status = message["status"]
                MutableHeaders(raw=_mutable_headers(message))[REQUEST_ID_HEADER] = request
            elif kind == "websocket.accept":
                # the name is not in the handshake: a narrow line takes 15 ms for it, before the first block
                status = 101
            elif kind == "websocket.close":
                # before the handshake it is a 403
                status = 403 if status == 499 else status
            await send(message)
            if scope["type"] == "websocket":
                done(status)

        with request_id.bind(request):
            try:
                await self._app(scope, receive, sending)
            except Exception:
                status = 500
                raise
            finally:
                done(status)

    def _record(self, scope: Scope, method: str, status: int, duration_s: float) -> None:
        path: str = scope["path"]
        route = scope.get(ROUTE_SCOPE_KEY) or (
            path if path in PROBE_PATHS else UNKNOWN_ROUTE if path.startswith(API_PREFIX) else PAGE_ROUTE
        )
        known = method if method in _KNOWN_METHODS or method == WEBSOCKET_METHOD else "OTHER"
        self._durations.observe((route, known, str(status)), duration_s)
        level = logging.DEBUG if path in PROBE_PATHS else logging.INFO
        if _log.isEnabledFor(level):
            told = {"method": method, "route": route, "path": path, "status": status, "seconds": round(duration_s, 6)}
            _log.log(level, "request", extra=told)


def _mutable_headers(message: Message) -> list[tuple[bytes, bytes]]:
    found: list[tuple[bytes, bytes]] = list(message.get("headers", ()))
    message["headers"] = found
    return found
