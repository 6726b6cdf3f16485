"""CORS headers for the allowed origins (Fetch Standard, section 3.2).

`bunraku.http.origin` parses the allowed origins; `AuthorizationMiddleware` rejects unsafe requests of other sites.
"""

from __future__ import annotations

from collections.abc import Collection

from starlette.datastructures import MutableHeaders
from starlette.middleware.cors import CORSMiddleware
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from bunraku.runtime.request_id import REQUEST_ID_HEADER

PREFLIGHT_MAX_AGE_S = 7_200
"""Time for which browsers may cache a preflight response. No browser caches it for longer."""


class CorsMiddleware:
    """Middleware that lets pages of `origins` read responses."""

    def __init__(self, app: ASGIApp, origins: Collection[str]) -> None:
        self._app = CORSMiddleware(
            app,
            allow_origins=sorted(origins),
            allow_methods=["*"],
            allow_headers=["Authorization", "Content-Type", REQUEST_ID_HEADER],
            expose_headers=["Location", "Retry-After", "WWW-Authenticate", REQUEST_ID_HEADER],
            max_age=PREFLIGHT_MAX_AGE_S,
        )

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        await self._app(scope, receive, _add_vary_origin(send) if scope["type"] == "http" else send)


def _add_vary_origin(send: Send) -> Send:
    """Add `Vary: Origin` to every response, so that caches store one response per origin, and one for no origin."""

    async def send_with_vary(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            if "origin" not in headers.get("vary", "").lower().replace(" ", "").split(","):
                headers.add_vary_header("Origin")
        await send(message)

    return send_with_vary
