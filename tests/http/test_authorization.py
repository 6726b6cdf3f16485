from __future__ import annotations

from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path
from typing import Any

import httpx2
import pytest
from fastapi import FastAPI, Request
from pydantic import SecretStr
from starlette.routing import Mount

from bunraku.access.app import create_app as access
from bunraku.http import problem_details
from bunraku.http.access_control import Role, access_of, requires
from bunraku.http.authorization import AuthorizationMiddleware, UndeclaredRequirement, collect_route_rules
from bunraku.ik.app import create_app as ik
from bunraku.ingest.app import create_app as ingest
from bunraku.runtime.context import open_context
from bunraku.runtime.settings import Settings
from bunraku.serve import compose_app
from bunraku.session.app import create_app as session
from bunraku.stream.app import create_app as stream
from tests.credentials import SECRET, bearer_headers, make_token


async def test_every_route_of_every_service_says_what_it_needs(tmp_path: Path) -> None:
    async with open_context(Settings(data=tmp_path)) as backing:
        apps = [ik(), *(make(backing) for make in (ingest, stream, session, access))]
        told = [way for app in apps for way in collect_route_rules(app.router.routes) if way.route.startswith("/v1/")]
    assert len(told) >= 24
    # beside health, and what says which routes there are, nothing of the API is for everybody
    assert all(way.requirement.role is not None for way in told)
    sockets = {way.route: way.requirement.role for way in told if not way.methods}
    assert sockets == {
        "/v1/motions/{motion}/stream": Role.VIEW,
        "/v1/sessions/{session}/stream": Role.VIEW,
        "/v1/sessions/{session}/control": Role.CONTROL,
    }


def test_an_app_with_a_route_that_does_not_say_is_not_guarded() -> None:
    app = FastAPI(openapi_url=None)

    @app.get("/v1/secret")
    async def forgotten() -> None: ...

    with pytest.raises(UndeclaredRequirement, match="/v1/secret does not say what it needs"):
        collect_route_rules(app.router.routes)
    with pytest.raises(UndeclaredRequirement, match="neither a route nor a socket"):
        collect_route_rules([Mount("/v1/more", FastAPI())])


@asynccontextmanager
async def guarded_app(tmp_path: Path, **given: Any) -> AsyncIterator[tuple[FastAPI, httpx2.AsyncClient]]:
    settings = Settings(data=tmp_path, **given)
    async with open_context(settings) as backing:
        app = FastAPI()
        problem_details.install_problem_handlers(app)

        @app.get("/v1/mine")
        @requires(Role.VIEW, allow_bound=True)
        async def mine(request: Request) -> str:
            return access_of(request).subject

        @app.put("/v1/changed")
        @requires(Role.VIEW, allow_bound=True, max_body_bytes=100)
        async def changed(request: Request) -> int:
            return len(await request.body())

        @app.get("/page")
        @requires(None)
        async def page() -> str:
            return "page"

        app.add_middleware(
            AuthorizationMiddleware,
            authenticator=backing.authenticator,
            rules=collect_route_rules(app.router.routes),
            settings=settings,
            metrics=backing.metrics,
        )
        # what nobody has told the guard of is not there
        app.get("/v1/later")(mine)
        transport = httpx2.ASGITransport(app, client=("192.0.2.1", 1))
        async with httpx2.AsyncClient(transport=transport, base_url="http://stage") as http:
            yield app, http


async def test_who_comes_is_known_to_the_route(tmp_path: Path) -> None:
    async with guarded_app(tmp_path, secret=SECRET) as (_, http):
        assert (await http.get("/v1/mine", headers=bearer_headers(make_token(subject="aiko")))).json() == "aiko"
        assert (await http.get("/v1/mine")).status_code == 401
        assert (await http.get("/page")).json() == "page"
        for given in ("Basic YTpi", "Bearer", "Bearer ", "bearer x", make_token()):
            assert (await http.get("/v1/mine", headers={"Authorization": given})).status_code == 401


@pytest.mark.parametrize("path", ["/v1/later", "/v1/mine/", "/v1/", "/v1/mine/more", "/v1//mine"])
@pytest.mark.parametrize("secret", ["", SECRET])
async def test_a_path_of_the_api_that_the_guard_does_not_know_is_not_there(
    tmp_path: Path, path: str, secret: str
) -> None:
    async with guarded_app(tmp_path, secret=secret) as (_, http):
        answer = await http.get(path, headers=bearer_headers(make_token()))
        assert (answer.status_code, answer.headers["content-type"]) == (404, "application/problem+json")


async def test_pages_of_other_sites_change_nothing_and_may_read_what_all_may(tmp_path: Path) -> None:
    for secret in ("", SECRET):
        async with guarded_app(tmp_path, secret=secret, origins="https://dance.example") as (_, http):
            http.headers.update(bearer_headers(make_token()))
            for origin, status in (
                ("http://stage", 200),
                ("https://dance.example", 200),
                ("https://evil.example", 403),
                ("null", 403),
                ("http://[::1", 403),
                ("http://stage.evil.example", 403),
            ):
                answer = await http.put("/v1/changed", headers={"Origin": origin})
                assert answer.status_code == status, origin
                assert (await http.get("/v1/mine", headers={"Origin": origin})).status_code == 200


async def test_without_a_secret_only_names_of_this_machine_are_answered(tmp_path: Path) -> None:
    async with guarded_app(tmp_path) as (_, http):
        for host in ("evil.example", "evil.example:8000", "127.0.0.1.evil.example"):
            answer = await http.get("/v1/mine", headers={"Host": host, "Origin": f"http://{host}"})
            assert answer.status_code == 403
            assert "BUNRAKU_SECRET" in answer.json()["hint"]
        for host in ("127.0.0.1:8000", "localhost", "[::1]:8000", "192.168.1.5"):
            assert (await http.get("/v1/mine", headers={"Host": host})).status_code == 200
    async with guarded_app(tmp_path, secret=SECRET) as (_, http):
        given = {"Host": "dance.example", **bearer_headers(make_token())}
        assert (await http.get("/v1/mine", headers=given)).status_code == 200


async def test_a_body_that_is_too_large_is_refused_whether_it_says_so_or_not(tmp_path: Path) -> None:
    async def pieces() -> AsyncIterator[bytes]:
        for _ in range(20):
            yield b"x" * 10

    async with guarded_app(tmp_path) as (_, http):
        assert (await http.put("/v1/changed", content=b"x" * 100)).json() == 100
        for answer in (
            await http.put("/v1/changed", content=b"x" * 101),
            await http.put("/v1/changed", content=pieces()),
            await http.put("/v1/changed", content=b"", headers={"Content-Length": "9" * 30}),
        ):
            assert answer.status_code == 413
            assert answer.headers["content-type"] == "application/problem+json"
            assert "100 bytes" in answer.json()["detail"]


async def test_who_guesses_tokens_is_slowed_down_by_address(tmp_path: Path) -> None:
    async with guarded_app(tmp_path, secret=SECRET, connects=1.0) as (app, http):
        told = [(await http.get("/v1/mine", headers=bearer_headers("guess"))).status_code for _ in range(12)]
        assert told == [401] * 10 + [429] * 2
        # one who has a token is not
        assert (await http.get("/v1/mine", headers=bearer_headers(make_token()))).status_code == 200
        transport = httpx2.ASGITransport(app, client=("192.0.2.2", 1))
        async with httpx2.AsyncClient(transport=transport, base_url="http://stage") as other:
            assert (await other.get("/v1/mine")).status_code == 401


async def test_the_description_says_how_to_come_in(tmp_path: Path) -> None:
    async with compose_app(Settings(data=tmp_path)) as app:
        described = app.openapi()
    assert described["components"]["securitySchemes"]["token"]["scheme"] == "bearer"
    assert described["paths"]["/v1/sessions/{session}"]["patch"]["x-role"] == "control"
    assert described["paths"]["/v1/motions"]["post"]["security"] == [{"token": []}]
    assert "security" not in described["paths"]["/v1/health"]["get"]


async def test_pages_of_allowed_sites_are_told_that_they_may_read_what_is_answered(tmp_path: Path) -> None:
    async with compose_app(Settings(data=tmp_path, secret=SecretStr(SECRET), origins="https://dance.example")) as app:
        transport = httpx2.ASGITransport(app)
        async with httpx2.AsyncClient(transport=transport, base_url="http://stage") as http:
            for origin, told in (("https://dance.example", "https://dance.example"), ("https://evil.example", None)):
                asked = {"Origin": origin, "Access-Control-Request-Method": "POST"}
                asked["Access-Control-Request-Headers"] = "authorization"
                preflight = await http.options("/v1/sessions", headers=asked)
                assert preflight.headers.get("access-control-allow-origin") == told
                answer = await http.get("/v1/motions", headers={"Origin": origin})
                assert answer.status_code == 401
                assert answer.headers.get("access-control-allow-origin") == told


async def test_tickets_count_as_the_sockets_that_they_are_for(tmp_path: Path) -> None:
    async with compose_app(Settings(data=tmp_path, secret=SecretStr(SECRET), connects=1.0)) as app:
        transport = httpx2.ASGITransport(app)
        async with httpx2.AsyncClient(
            transport=transport, base_url="http://stage", headers=bearer_headers(make_token())
        ) as http:
            told = [(await http.post("/v1/tickets")).status_code for _ in range(12)]
            assert told == [201] * 10 + [429] * 2
            assert (await http.get("/v1/motions")).status_code == 200
