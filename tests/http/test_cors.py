from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

import httpx2
import pytest
from pydantic import SecretStr, ValidationError
from starlette.applications import Starlette
from starlette.requests import Request
from starlette.responses import PlainTextResponse, Response
from starlette.routing import Route

from bunraku.http.cors import CorsMiddleware
from bunraku.http.origin import parse_origins
from bunraku.runtime.settings import Settings

SITE = "https://dance.example"
SECRET = "a secret of thirty-two bytes or more"


async def _answer(request: Request) -> Response:
    if request.url.path == "/failing":
        return PlainTextResponse("no", 503, {"Retry-After": "1", "Vary": "Accept-Encoding"})
    return PlainTextResponse("yes", headers={"Cache-Control": "public, immutable", "Vary": "origin"})


@asynccontextmanager
async def cors_client(origins: str = SITE) -> AsyncIterator[httpx2.AsyncClient]:
    inner = Starlette(routes=[Route("/{name}", _answer, methods=["GET", "PATCH"])])
    transport = httpx2.ASGITransport(CorsMiddleware(inner, parse_origins(origins)))
    async with httpx2.AsyncClient(transport=transport, base_url="http://stage") as http:
        yield http


async def test_only_allowed_origins_may_read() -> None:
    async with cors_client() as http:
        for path, status in (("/there", 200), ("/failing", 503)):
            for origin, allowed in (
                (SITE, SITE),
                ("https://evil.example", None),
                ("null", None),
                (f"{SITE}.evil.example", None),
            ):
                answer = await http.get(path, headers={"Origin": origin})
                assert answer.status_code == status
                assert answer.headers.get("access-control-allow-origin") == allowed
                assert "access-control-allow-credentials" not in answer.headers
        exposed_headers = (await http.get("/failing", headers={"Origin": SITE})).headers[
            "access-control-expose-headers"
        ]
        assert "Retry-After" in exposed_headers


async def test_responses_vary_by_origin() -> None:
    async with cors_client() as http:
        for headers in ({}, {"Origin": SITE}, {"Origin": "https://evil.example"}):
            there = await http.get("/there", headers=headers)
            assert {field.strip().lower() for field in there.headers["vary"].split(",")} == {"origin"}
            failing = await http.get("/failing", headers=headers)
            assert {field.strip() for field in failing.headers["vary"].split(",")} == {"Accept-Encoding", "Origin"}


async def test_preflight_names_allowed_methods_and_headers() -> None:
    async with cors_client() as http:
        preflight = {
            "Access-Control-Request-Method": "PATCH",
            "Access-Control-Request-Headers": "authorization,content-type",
        }
        accepted = await http.options("/there", headers={"Origin": SITE, **preflight})
        assert accepted.status_code == 200
        assert accepted.headers["access-control-allow-origin"] == SITE
        assert "PATCH" in accepted.headers["access-control-allow-methods"]
        assert "Authorization" in accepted.headers["access-control-allow-headers"]
        assert int(accepted.headers["access-control-max-age"]) > 0
        rejected = await http.options("/there", headers={"Origin": "https://evil.example", **preflight})
        assert rejected.status_code == 400
        assert "access-control-allow-origin" not in rejected.headers
        assert "Origin" in rejected.headers["vary"]


async def test_null_origin_must_be_allowed_and_needs_a_secret(tmp_path: Path) -> None:
    async with cors_client(f"{SITE},null") as http:
        assert (await http.get("/there", headers={"Origin": "null"})).headers["access-control-allow-origin"] == "null"
    with pytest.raises(ValidationError, match="set BUNRAKU_SECRET"):
        Settings(data=tmp_path, origins="null")
    assert Settings(data=tmp_path, origins="null", secret=SecretStr(SECRET)).origins == "null"
