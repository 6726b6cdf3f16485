from __future__ import annotations

import asyncio
import dataclasses
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
from bunraku.http import authorization, problem_details
from bunraku.http.access_control import Role, access_of, requires
from bunraku.http.authorization import (
    MAX_REQUESTS_WITH_BODY_PER_HOLDER,
    AuthorizationMiddleware,
    UndeclaredRequirement,
    collect_route_rules,
)
from bunraku.ik.app import create_app as ik
from bunraku.ingest.app import create_app as ingest
from bunraku.runtime.context import open_context
from bunraku.runtime.settings import Settings
from bunraku.serve import compose_app
from bunraku.session.app import create_app as session
from bunraku.stream.app import create_app as stream
from tests.connection_limit import limit_connections
from tests.credentials import SECRET, bearer_headers, make_token
from tests.time_limit import HANG_TIMEOUT_S


async def test_every_route_declares_its_requirement(tmp_path: Path) -> None:
    async with open_context(Settings(data=tmp_path)) as context:
        apps = [ik(), *(make(context) for make in (ingest, stream, session, access))]
        rules = [rule for app in apps for rule in collect_route_rules(app.router.routes)]
    assert len(rules) >= 24
    # public API routes are only health and the API description, which these services do not have
    assert all(rule.requirement.role is not None for rule in rules)
    websocket_roles = {rule.route: rule.requirement.role for rule in rules if not rule.methods}
    assert websocket_roles == {
        "/v1/motions/{motion}/stream": Role.VIEW,
        "/v1/sessions/{session}/stream": Role.VIEW,
        "/v1/sessions/{session}/control": Role.CONTROL,
        "/v1/performers/{performer}/input": Role.INGEST,
    }


def test_route_without_requirement_raises() -> None:
    app = FastAPI(openapi_url=None)

    @app.get("/v1/secret")
    async def forgotten() -> None: ...

    with pytest.raises(UndeclaredRequirement, match="/v1/secret declares no requirement"):
        collect_route_rules(app.router.routes)
    # FastAPI's documentation pages load scripts of other sites
    with pytest.raises(UndeclaredRequirement, match=r"openapi.json declares no requirement"):
        collect_route_rules(FastAPI().router.routes)
    with pytest.raises(UndeclaredRequirement, match="neither an HTTP route nor a WebSocket"):
        collect_route_rules([Mount("/v1/more", FastAPI())])


@asynccontextmanager
async def protected_app(tmp_path: Path, **options: Any) -> AsyncIterator[tuple[FastAPI, httpx2.AsyncClient]]:
    settings = Settings(data=tmp_path, **options)
    async with open_context(settings) as context:
        app = FastAPI(openapi_url=None)
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
            # a clock that stands still makes the rate limits exact
            context=dataclasses.replace(context, clock=lambda: 1_000_000),
            rules=collect_route_rules(app.router.routes),
        )
        # a route that is added after the rules were collected
        app.get("/v1/later")(mine)
        transport = httpx2.ASGITransport(app, client=("192.0.2.1", 1))
        async with httpx2.AsyncClient(transport=transport, base_url="http://stage") as http:
            yield app, http


async def test_route_receives_the_access_of_the_token(tmp_path: Path) -> None:
    async with protected_app(tmp_path, secret=SECRET) as (_, http):
        assert (await http.get("/v1/mine", headers=bearer_headers(make_token(subject="aiko")))).json() == "aiko"
        assert (await http.get("/v1/mine")).status_code == 401
        assert (await http.get("/page")).json() == "page"
        for header in ("Basic YTpi", "Bearer", "Bearer ", "bearer x", make_token()):
            assert (await http.get("/v1/mine", headers={"Authorization": header})).status_code == 401


@pytest.mark.parametrize("path", ["/v1/later", "/v1/mine/", "/v1/", "/v1/mine/more", "/v1//mine"])
@pytest.mark.parametrize("secret", ["", SECRET])
async def test_api_path_without_rule_is_not_found(tmp_path: Path, path: str, secret: str) -> None:
    async with protected_app(tmp_path, secret=secret) as (_, http):
        answer = await http.get(path, headers=bearer_headers(make_token()))
        assert (answer.status_code, answer.headers["content-type"]) == (404, "application/problem+json")


async def test_other_sites_may_read_but_not_change(tmp_path: Path) -> None:
    for secret in ("", SECRET):
        async with protected_app(tmp_path, secret=secret, origins="https://dance.example") as (_, http):
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


async def test_server_without_secret_accepts_only_local_host_names(tmp_path: Path) -> None:
    async with protected_app(tmp_path) as (_, http):
        for host in ("evil.example", "evil.example:8000", "127.0.0.1.evil.example"):
            answer = await http.get("/v1/mine", headers={"Host": host, "Origin": f"http://{host}"})
            assert answer.status_code == 403
            assert "BUNRAKU_SECRET" in answer.json()["hint"]
        for host in ("127.0.0.1:8000", "localhost", "[::1]:8000", "192.168.1.5"):
            assert (await http.get("/v1/mine", headers={"Host": host})).status_code == 200
    async with protected_app(tmp_path, secret=SECRET) as (_, http):
        headers = {"Host": "dance.example", **bearer_headers(make_token())}
        assert (await http.get("/v1/mine", headers=headers)).status_code == 200


async def test_too_large_body_is_rejected_with_and_without_length(tmp_path: Path) -> None:
    async def chunks() -> AsyncIterator[bytes]:
        for _ in range(20):
            yield b"x" * 10

    async with protected_app(tmp_path) as (_, http):
        assert (await http.put("/v1/changed", content=b"x" * 100)).json() == 100
        for answer in (
            await http.put("/v1/changed", content=b"x" * 101),
            await http.put("/v1/changed", content=chunks()),
            await http.put("/v1/changed", content=b"", headers={"Content-Length": "9" * 30}),
        ):
            assert answer.status_code == 413
            assert answer.headers["content-type"] == "application/problem+json"
            assert "100 bytes" in answer.json()["detail"]


async def test_unfinished_bodies_are_limited_by_subject(tmp_path: Path) -> None:
    unfinished, all_begun, end = 0, asyncio.Event(), asyncio.Event()

    async def body() -> AsyncIterator[bytes]:
        nonlocal unfinished
        unfinished += 1
        if unfinished == MAX_REQUESTS_WITH_BODY_PER_HOLDER:
            all_begun.set()
        yield b"x"
        await end.wait()

    async with protected_app(tmp_path, secret=SecretStr(SECRET)) as (_, http):

        async def put(subject: str, content: bytes | AsyncIterator[bytes]) -> httpx2.Response:
            headers = bearer_headers(make_token(Role.VIEW, subject))
            return await http.put("/v1/changed", content=content, headers=headers)

        begun = [asyncio.create_task(put("hostile", body())) for _ in range(MAX_REQUESTS_WITH_BODY_PER_HOLDER)]
        async with asyncio.timeout(HANG_TIMEOUT_S):
            await all_begun.wait()
        refused = await put("hostile", b"x")
        assert (refused.status_code, refused.headers["retry-after"]) == (503, "2")
        assert (await put("hostile", b"")).status_code == 200
        assert (await put("calm", b"x")).status_code == 200
        end.set()
        assert {one.status_code for one in await asyncio.gather(*begun)} == {200}
        assert (await put("hostile", b"x")).status_code == 200


async def test_invalid_tokens_are_rate_limited_by_address(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    async with protected_app(tmp_path, secret=SECRET, connects=limit_connections(monkeypatch, 10)) as (app, http):
        statuses = [(await http.get("/v1/mine", headers=bearer_headers("guess"))).status_code for _ in range(12)]
        assert statuses == [401] * 10 + [429] * 2
        # a client with a valid token is not limited
        assert (await http.get("/v1/mine", headers=bearer_headers(make_token()))).status_code == 200
        transport = httpx2.ASGITransport(app, client=("192.0.2.2", 1))
        async with httpx2.AsyncClient(transport=transport, base_url="http://stage") as other:
            assert (await other.get("/v1/mine")).status_code == 401


async def test_api_description_includes_security_and_roles(tmp_path: Path) -> None:
    async with compose_app(Settings(data=tmp_path)) as app:
        described = app.openapi()
    assert described["components"]["securitySchemes"]["token"]["scheme"] == "bearer"
    assert described["paths"]["/v1/sessions/{session}"]["patch"]["x-role"] == "control"
    assert described["paths"]["/v1/motions"]["post"]["security"] == [{"token": []}]
    assert "security" not in described["paths"]["/v1/health"]["get"]


async def test_allowed_origins_get_cors_headers(tmp_path: Path) -> None:
    async with compose_app(Settings(data=tmp_path, secret=SecretStr(SECRET), origins="https://dance.example")) as app:
        transport = httpx2.ASGITransport(app)
        async with httpx2.AsyncClient(transport=transport, base_url="http://stage") as http:
            for origin, allowed in (("https://dance.example", "https://dance.example"), ("https://evil.example", None)):
                preflight_headers = {"Origin": origin, "Access-Control-Request-Method": "POST"}
                preflight_headers["Access-Control-Request-Headers"] = "authorization"
                preflight = await http.options("/v1/sessions", headers=preflight_headers)
                assert preflight.headers.get("access-control-allow-origin") == allowed
                answer = await http.get("/v1/motions", headers={"Origin": origin})
                assert answer.status_code == 401
                assert answer.headers.get("access-control-allow-origin") == allowed


@asynccontextmanager
async def serve_app(settings: Settings) -> AsyncIterator[httpx2.AsyncClient]:
    async with (
        compose_app(settings) as app,
        httpx2.AsyncClient(transport=httpx2.ASGITransport(app), base_url="http://127.0.0.1") as http,
    ):
        yield http


async def test_changes_of_one_subject_are_limited_on_every_route(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(authorization, "CHANGES_PER_S", 1e-6)
    monkeypatch.setattr(authorization, "CHANGE_BURST", 5)
    changes = [
        ("POST", "/v1/sessions"),
        ("PATCH", "/v1/sessions/none"),
        ("POST", "/v1/sessions/none/recordings"),
        ("POST", "/v1/shares"),
        ("POST", "/v1/motions/none/performers"),
    ]
    first, second = (bearer_headers(make_token(Role.INGEST, name)) for name in ("first", "second"))
    async with serve_app(Settings(data=tmp_path, secret=SecretStr(SECRET))) as http:
        for method, path in changes:
            assert (await http.request(method, path, headers=first)).status_code in (400, 404, 422)
        for method, path in changes:
            refused = await http.request(method, path, headers=first)
            assert refused.status_code == 429
            assert refused.json()["title"] == "Too many changes"
            assert refused.headers["retry-after"] == "1"
        assert (await http.get("/v1/sessions", headers=first)).status_code == 200
        assert (await http.post("/v1/tickets", headers=first)).status_code == 201
        # links stay revocable
        for path in ("/v1/sessions/none", "/v1/shares/" + "0" * 18, "/v1/motions/none"):
            assert (await http.delete(path, headers=first)).status_code == 404
        assert (await http.patch("/v1/sessions/none", json={}, headers=second)).status_code == 404
    async with serve_app(Settings(data=tmp_path / "open")) as http:
        assert {(await http.patch("/v1/sessions/none", json={})).status_code for _ in range(12)} == {404}


async def test_tickets_count_towards_the_connection_rate(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    connects = limit_connections(monkeypatch, 10)
    async with compose_app(Settings(data=tmp_path, secret=SecretStr(SECRET), connects=connects)) as app:
        transport = httpx2.ASGITransport(app)
        async with httpx2.AsyncClient(
            transport=transport, base_url="http://stage", headers=bearer_headers(make_token())
        ) as http:
            statuses = [(await http.post("/v1/tickets")).status_code for _ in range(12)]
            assert statuses == [201] * 10 + [429] * 2
            assert (await http.get("/v1/motions")).status_code == 200
