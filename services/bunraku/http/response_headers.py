"""Headers of all responses: content security, and caching of what needed a token."""

from __future__ import annotations

from starlette.datastructures import MutableHeaders
from starlette.types import ASGIApp, Message, Receive, Scope, Send

INERT_MEDIA_TYPES = frozenset(
    {"application/octet-stream", "application/json", "application/problem+json", "application/msgpack"}
)
"""Media types that a browser never runs or renders, if it does not guess (`nosniff`)."""
DOCUMENT_HEADERS = {
    "Content-Security-Policy": "default-src 'none'; frame-ancestors 'none'",
    "X-Frame-Options": "DENY",
}
"""Headers of every other response without such headers: it loads nothing, runs nothing and cannot be framed."""


class ContentSecurityMiddleware:
    """Middleware that adds `X-Content-Type-Options` to every response and `DOCUMENT_HEADERS` where they matter."""

    def __init__(self, app: ASGIApp) -> None:
        self._app = app

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        async def send_secured(message: Message) -> None:
            if message["type"] in ("http.response.start", "websocket.http.response.start"):
                headers = MutableHeaders(scope=message)
                headers.setdefault("X-Content-Type-Options", "nosniff")
                if headers.get("content-type", "").partition(";")[0].strip().lower() not in INERT_MEDIA_TYPES:
                    for name, value in DOCUMENT_HEADERS.items():
                        headers.setdefault(name, value)
            await send(message)

        await self._app(scope, receive, send_secured)


def mark_cache_private(send: Send) -> Send:
    """Return `send` for a response that needed a token: no shared cache may store it (RFC 9111, section 5.2.2).

    Without Cache-Control the response must be validated before it is used again. `Vary: Authorization`
    keeps a browser from using it with another token. Responses with `no-store` stay unchanged.
    """

    async def send_private(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            directives = [one.strip().lower() for one in ",".join(headers.getlist("cache-control")).split(",")]
            if "no-store" not in directives:
                kept = [
                    one
                    for one in directives
                    if one.partition("=")[0] not in ("", "public", "private", "s-maxage", "proxy-revalidate")
                ]
                headers["Cache-Control"] = ", ".join(["private", *(kept or ["no-cache"])])
                headers.add_vary_header("Authorization")
        await send(message)

    return send_private
