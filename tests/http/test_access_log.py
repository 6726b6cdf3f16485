from __future__ import annotations

import contextlib
import logging
from collections.abc import AsyncIterator, Awaitable, Callable
from typing import Any

import httpx2
import pytest
from prometheus_client import generate_latest
from starlette.applications import Starlette
from starlette.requests import ClientDisconnect, Request
from starlette.responses import PlainTextResponse, Response
from starlette.routing import Route
from starlette.types import Receive, Scope, Send

from bunraku.http.access_log import ROUTE_SCOPE_KEY, AccessLogMiddleware
from bunraku.runtime import request_id
from bunraku.runtime.metrics import Metrics
from tests.metrics import MetricSamples


class FakeClock:
    """Clock in microseconds that advances by a quarter of a second at each call."""

    def __init__(self) -> None:
        self.now_us = 1_000_000

    def __call__(self) -> int:
        self.now_us += 250_000
        return self.now_us


async def answer(request: Request) -> Response:
    request.scope[ROUTE_SCOPE_KEY] = "/v1/things/{thing}"
    return PlainTextResponse(request_id.current(), 418 if request.method == "POST" else 200)


async def read_body(request: Request) -> Response:
    await request.body()
    return PlainTextResponse("read")


async def read_body_and_answer(request: Request) -> Response:
    with contextlib.suppress(ClientDisconnect):
        await request.body()
    return PlainTextResponse("unread", 400)


async def fail(_: Request) -> Response:
    raise LookupError("server error")


@pytest.fixture
async def logged_app() -> AsyncIterator[tuple[httpx2.AsyncClient, Metrics]]:
    metrics = Metrics()
    routes = [Route("/v1/things/{thing}", answer, methods=["GET", "POST"]), Route("/v1/fail", fail)]
    app = AccessLogMiddleware(Starlette(routes=[*routes, Route("/livez", answer)]), metrics, FakeClock())
    transport = httpx2.ASGITransport(app, raise_app_exceptions=False)
    async with httpx2.AsyncClient(transport=transport, base_url="http://stage") as http:
        yield http, metrics


def request_count(metrics: Metrics, **labels: str) -> float:
    return MetricSamples(generate_latest(metrics.registry).decode()).sum("request_duration_seconds_count", **labels)


async def test_valid_request_id_is_kept_and_an_invalid_one_replaced(
    logged_app: tuple[httpx2.AsyncClient, Metrics],
) -> None:
    http, _ = logged_app
    answered = await http.get("/v1/things/1", headers={"X-Request-Id": "from-a-proxy_1"})
    assert answered.headers["x-request-id"] == answered.text == "from-a-proxy_1"
    for forged in ("x" * 65, "a;b c\td", "<script>"):
        replaced = await http.get("/v1/things/1", headers={"X-Request-Id": forged})
        assert replaced.headers["x-request-id"] == replaced.text != forged
        assert len(replaced.text) == 16
    assert request_id.current() == ""


async def test_request_is_counted_by_route_and_logged_without_query(
    logged_app: tuple[httpx2.AsyncClient, Metrics], caplog: pytest.LogCaptureFixture
) -> None:
    http, metrics = logged_app
    with caplog.at_level(logging.INFO, "bunraku"):
        await http.get("/v1/things/1?ticket=very-secret")
        await http.post("/v1/things/2")
        await http.get("/v1/nowhere?ticket=very-secret")
        await http.get("/index.html")
        await http.get("/v1/fail")
    assert request_count(metrics, route="/v1/things/{thing}", method="GET", status="200") == 1
    assert request_count(metrics, route="/v1/things/{thing}", method="POST", status="418") == 1
    assert request_count(metrics, route="elsewhere", method="GET", status="404") == 1
    assert request_count(metrics, route="page", method="GET", status="404") == 1
    assert request_count(metrics, route="elsewhere", method="GET", status="500") == 1
    record: Any = next(record for record in caplog.records if record.getMessage() == "request")
    assert (record.method, record.status) == ("GET", 200)
    assert (record.route, record.path) == ("/v1/things/{thing}", "/v1/things/1")
    assert record.seconds == 0.25
    assert "very-secret" not in "".join(str(record.__dict__) for record in caplog.records)


async def test_probes_are_logged_at_debug_level_only(
    logged_app: tuple[httpx2.AsyncClient, Metrics], caplog: pytest.LogCaptureFixture
) -> None:
    http, metrics = logged_app
    with caplog.at_level(logging.INFO, "bunraku"):
        await http.get("/livez")
    assert not [record for record in caplog.records if record.name.startswith("bunraku")]
    with caplog.at_level(logging.DEBUG, "bunraku"):
        await http.get("/livez")
    assert [record for record in caplog.records if record.name == "bunraku.http.access_log"]
    assert request_count(metrics, method="GET") == 2


@pytest.mark.parametrize("endpoint", [read_body, read_body_and_answer])
async def test_client_that_disconnects_within_its_body_is_counted_as_499(
    endpoint: Callable[[Request], Awaitable[Response]],
) -> None:
    metrics, messages = Metrics(), [{"type": "http.request", "body": b"{", "more_body": True}]

    async def receive() -> Any:
        return messages.pop() if messages else {"type": "http.disconnect"}

    async def send(_: Any) -> None:
        """Discard the response, as nobody receives it."""

    app = AccessLogMiddleware(Starlette(routes=[Route("/v1/body", endpoint, methods=["POST"])]), metrics, FakeClock())
    scope = {"type": "http", "method": "POST", "path": "/v1/body", "headers": [], "query_string": b""}
    await app(scope, receive, send)
    assert request_count(metrics) == request_count(metrics, method="POST", status="499") == 1


@pytest.mark.parametrize(
    ("sent", "status"),
    [
        (["websocket.accept"], "101"),
        (["websocket.accept", "websocket.send", "websocket.close"], "101"),
        (["websocket.close"], "403"),
        (["websocket.http.response.start", "websocket.http.response.body"], "429"),
        ([], "499"),
    ],
)
async def test_websocket_is_counted_once_by_handshake_status(sent: list[str], status: str) -> None:
    metrics, messages = Metrics(), []

    async def app(scope: Scope, _: Receive, send: Send) -> None:
        assert request_id.current() == "from-a-proxy"
        for kind in sent:
            await send({"type": kind, "status": 429, "headers": []})
            scope[ROUTE_SCOPE_KEY] = "/v1/things/{thing}/stream"

    async def send(message: Any) -> None:
        messages.append(message)

    async def receive() -> Any:
        raise AssertionError("the app must not receive")

    scope = {"type": "websocket", "path": "/v1/things/1/stream", "headers": [(b"x-request-id", b"from-a-proxy")]}
    await AccessLogMiddleware(app, metrics, FakeClock())(scope, receive, send)
    assert [message["type"] for message in messages] == sent
    assert request_count(metrics) == request_count(metrics, method="WEBSOCKET", status=status) == 1
    with_request_id = [message for message in messages if (b"x-request-id", b"from-a-proxy") in message["headers"]]
    assert len(with_request_id) == (status == "429")
