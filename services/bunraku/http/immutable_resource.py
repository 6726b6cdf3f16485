"""Responses for resources that never change: an entity tag, a year of caching, and 304 for a client that has it."""

from __future__ import annotations

from starlette.responses import Response

IMMUTABLE_CACHE_CONTROL = "public, max-age=31536000, immutable"


def immutable_headers(etag: str) -> dict[str, str]:
    """Return the headers of an immutable resource with a strong entity tag, which includes its quotes."""
    return {"ETag": etag, "Cache-Control": IMMUTABLE_CACHE_CONTROL}


def not_modified(if_none_match: str | None, etag: str) -> Response | None:
    """Return the response 304 if the client has the resource, by weak comparison of tags (RFC 9110, 13.1.2)."""
    if if_none_match is None:
        return None
    tags = [tag.strip().removeprefix("W/") for tag in if_none_match.split(",")]
    return Response(status_code=304, headers=immutable_headers(etag)) if "*" in tags or etag in tags else None
