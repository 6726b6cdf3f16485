"""Pages of other sites that the settings name: what their browsers are told, so that they let them read the answers.

Fetch Standard, 3.2 (CORS protocol). Which they are says `bunraku.http.origin`; what others may not do, the guard.
"""

from __future__ import annotations

from collections.abc import Collection

from starlette.datastructures import MutableHeaders
from starlette.middleware.cors import CORSMiddleware
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from bunraku.runtime.request_id import REQUEST_ID_HEADER

PREFLIGHT_MAX_AGE_S = 7_200
"""How long a browser need not ask again whether it may ask; none keeps it longer."""


class CorsMiddleware:
    """Stands before an app whose answers pages of `origins` may read."""

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
        """As ASGI has it."""
        await self._app(scope, receive, _add_vary_origin(send) if scope["type"] == "http" else send)


def _add_vary_origin(send: Send) -> Send:
    """A cache on the way must not give one site's page what it kept for another's, or for one that said no origin."""

    async def sending(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            if "origin" not in headers.get("vary", "").lower().replace(" ", "").split(","):
                headers.add_vary_header("Origin")
        await send(message)

    return sending
