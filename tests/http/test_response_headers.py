from __future__ import annotations

import httpx2
import pytest
from starlette.responses import Response
from starlette.types import Receive, Scope, Send

from bunraku.http.response_headers import DOCUMENT_HEADERS, ContentSecurityMiddleware, mark_cache_private


async def get_headers(response: Response, *, secured: bool = False) -> httpx2.Headers:
    """Return the headers of `response` after the function or middleware under test."""

    async def app(scope: Scope, receive: Receive, send: Send) -> None:
        await response(scope, receive, send if secured else mark_cache_private(send))

    transport = httpx2.ASGITransport(ContentSecurityMiddleware(app) if secured else app)
    async with httpx2.AsyncClient(transport=transport, base_url="http://stage") as http:
        return (await http.get("/")).headers


@pytest.mark.parametrize(
    ("own", "expected"),
    [
        (None, "private, no-cache"),
        ("", "private, no-cache"),
        ("public, max-age=31536000, immutable", "private, max-age=31536000, immutable"),
        ("PUBLIC,Max-Age=5", "private, max-age=5"),
        ("max-age=60, s-maxage=600, proxy-revalidate", "private, max-age=60"),
        ("private", "private, no-cache"),
        ("no-cache", "private, no-cache"),
        ("no-store", "no-store"),
        ("public, no-store", "public, no-store"),
    ],
)
async def test_response_that_needed_a_token_is_for_private_caches_only(own: str | None, expected: str) -> None:
    headers = await get_headers(Response(headers={} if own is None else {"Cache-Control": own}))
    assert headers["cache-control"] == expected
    assert ("vary" in headers) is ("no-store" not in expected)


async def test_vary_is_extended() -> None:
    headers = await get_headers(Response(headers={"Vary": "Origin"}))
    assert headers["vary"] == "Origin, Authorization"


@pytest.mark.parametrize("media_type", [None, "text/html", "image/svg+xml", "text/javascript", "application/xml"])
async def test_document_may_load_nothing_and_cannot_be_framed(media_type: str | None) -> None:
    headers = await get_headers(Response(b"x", media_type=media_type), secured=True)
    assert headers["x-content-type-options"] == "nosniff"
    for name, value in DOCUMENT_HEADERS.items():
        assert headers[name] == value


async def test_own_policy_and_inert_media_types_stay_as_they_are() -> None:
    own = {"Content-Security-Policy": "default-src 'self'"}
    assert (await get_headers(Response(b"x", headers=own, media_type="text/html"), secured=True))[
        "content-security-policy"
    ] == "default-src 'self'"
    headers = await get_headers(Response(b"x", media_type="application/octet-stream"), secured=True)
    assert headers["x-content-type-options"] == "nosniff"
    assert "content-security-policy" not in headers
