"""Access log: request id, duration, one log record and one metric sample per request and WebSocket handshake."""

from __future__ import annotations

import logging
from collections.abc import Callable
from http import HTTPMethod

from starlette.datastructures import Headers, MutableHeaders
from starlette.requests import ClientDisconnect
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from bunraku.runtime import request_id
from bunraku.runtime.metrics import LabelledHistograms, Metrics
from bunraku.runtime.request_id import REQUEST_ID_HEADER

ROUTE_SCOPE_KEY = "bunraku.route"
"""Key of the ASGI scope under which `AuthorizationMiddleware` stores the path of the route: `/v1/motions/{motion}`."""
API_PREFIX = "/v1/"
UNKNOWN_ROUTE = "elsewhere"
"""Route label of API paths without a route."""
PAGE_ROUTE = "page"
"""Route label of the page and its files."""
WEBSOCKET_METHOD = "WEBSOCKET"
"""Method label of WebSocket handshakes."""
PROBE_PATHS = ("/livez", "/readyz", "/v1/health")
"""Paths that orchestrators request every few seconds. They are logged at level DEBUG."""
CLIENT_CLOSED_REQUEST = 499
"""Status of a request whose client disconnected before the response, as in the logs of nginx."""

_KNOWN_METHODS = frozenset(HTTPMethod)
_log = logging.getLogger(__name__)


class AccessLogMiddleware:
    """Outermost middleware, which logs and measures every request.

    A WebSocket is recorded when its handshake is accepted or rejected; its end is logged by the endpoint.
    """

    def __init__(self, app: ASGIApp, metrics: Metrics, clock: Callable[[], int]) -> None:
        """`clock` returns microseconds."""
        self._app = app
        self._clock = clock
        self._durations = LabelledHistograms()
        metrics.histograms(
            "request_duration_seconds",
            "Duration of requests and of WebSocket handshakes by route, method and status",
            self._durations,
            ("route", "method", "status"),
        )

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        if scope["type"] not in ("http", "websocket"):
            await self._app(scope, receive, send)
            return
        request = request_id.accept_or_generate(Headers(scope=scope).getlist(REQUEST_ID_HEADER))
        started_at, is_recorded = self._clock(), False

        def record_once(status: int) -> None:
            nonlocal is_recorded
            if not is_recorded:
                is_recorded = True
                self._record(scope, status, (self._clock() - started_at) / 1e6)

        status = CLIENT_CLOSED_REQUEST
        is_started = is_disconnected = False

        async def receive_and_note() -> Message:
            nonlocal is_disconnected
            message = await receive()
            is_disconnected = is_disconnected or (message["type"] == "http.disconnect" and not is_started)
            return message

        async def send_and_record(message: Message) -> None:
            nonlocal status, is_started
            kind = message["type"]
            is_started = True
            if kind in ("http.response.start", "websocket.http.response.start"):
                # nobody receives the response to a client that has disconnected
                status = CLIENT_CLOSED_REQUEST if is_disconnected else message["status"]
                MutableHeaders(raw=_mutable_headers(message))[REQUEST_ID_HEADER] = request
            elif kind == "websocket.accept":
                # no request id in the handshake: it would delay the first block by 15 ms on a constrained link
                status = 101
            elif kind == "websocket.close":
                # a close before the handshake is sent as a 403
                status = 403 if status == CLIENT_CLOSED_REQUEST else status
            await send(message)
            if scope["type"] == "websocket":
                record_once(status)

        with request_id.bind(request):
            try:
                await self._app(scope, receive_and_note, send_and_record)
            except ClientDisconnect:
                status = CLIENT_CLOSED_REQUEST
            except Exception:
                status = 500
                raise
            finally:
                record_once(status)

    def _record(self, scope: Scope, status: int, duration_s: float) -> None:
        path: str = scope["path"]
        method: str = scope.get("method", WEBSOCKET_METHOD)
        route = scope.get(ROUTE_SCOPE_KEY) or (
            path if path in PROBE_PATHS else UNKNOWN_ROUTE if path.startswith(API_PREFIX) else PAGE_ROUTE
        )
        method_label = method if method in _KNOWN_METHODS or method == WEBSOCKET_METHOD else "OTHER"
        self._durations.observe((route, method_label, str(status)), duration_s)
        level = logging.DEBUG if path in PROBE_PATHS else logging.INFO
        if _log.isEnabledFor(level):
            fields = {"method": method, "route": route, "path": path, "status": status, "seconds": round(duration_s, 6)}
            _log.log(level, "request", extra=fields)


def _mutable_headers(message: Message) -> list[tuple[bytes, bytes]]:
    headers: list[tuple[bytes, bytes]] = list(message.get("headers", ()))
    message["headers"] = headers
    return headers
