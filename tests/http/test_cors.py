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


async def test_pages_of_the_sites_that_are_named_may_read_and_no_others() -> None:
    async with cors_client() as http:
        for path, status in (("/there", 200), ("/failing", 503)):
            for origin, told in (
                (SITE, SITE),
                ("https://evil.example", None),
                ("null", None),
                (f"{SITE}.evil.example", None),
            ):
                answer = await http.get(path, headers={"Origin": origin})
                assert answer.status_code == status
                assert answer.headers.get("access-control-allow-origin") == told
                assert "access-control-allow-credentials" not in answer.headers
        told_of = (await http.get("/failing", headers={"Origin": SITE})).headers["access-control-expose-headers"]
        assert "Retry-After" in told_of


async def test_a_cache_keeps_what_one_origin_was_told_for_that_alone() -> None:
    async with cors_client() as http:
        for headers in ({}, {"Origin": SITE}, {"Origin": "https://evil.example"}):
            there = await http.get("/there", headers=headers)
            assert {one.strip().lower() for one in there.headers["vary"].split(",")} == {"origin"}
            failing = await http.get("/failing", headers=headers)
            assert {one.strip() for one in failing.headers["vary"].split(",")} == {"Accept-Encoding", "Origin"}


async def test_whether_one_may_ask_is_answered_before_it_is_asked() -> None:
    async with cors_client() as http:
        wishes = {
            "Access-Control-Request-Method": "PATCH",
            "Access-Control-Request-Headers": "authorization,content-type",
        }
        may = await http.options("/there", headers={"Origin": SITE, **wishes})
        assert may.status_code == 200
        assert may.headers["access-control-allow-origin"] == SITE
        assert "PATCH" in may.headers["access-control-allow-methods"]
        assert "Authorization" in may.headers["access-control-allow-headers"]
        assert int(may.headers["access-control-max-age"]) > 0
        may_not = await http.options("/there", headers={"Origin": "https://evil.example", **wishes})
        assert may_not.status_code == 400
        assert "access-control-allow-origin" not in may_not.headers
        assert "Origin" in may_not.headers["vary"]


async def test_pages_without_an_origin_are_let_in_by_name_and_only_by_a_secret(tmp_path: Path) -> None:
    async with cors_client(f"{SITE},null") as http:
        assert (await http.get("/there", headers={"Origin": "null"})).headers["access-control-allow-origin"] == "null"
    with pytest.raises(ValidationError, match="it takes a secret"):
        Settings(data=tmp_path, origins="null")
    assert Settings(data=tmp_path, origins="null", secret=SecretStr(SECRET)).origins == "null"
