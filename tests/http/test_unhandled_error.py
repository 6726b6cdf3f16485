from __future__ import annotations

import asyncio
import errno
import logging
import tempfile
from collections.abc import AsyncIterator
from pathlib import Path

import httpx2
import pytest
from fastapi import FastAPI, Request
from fastapi.responses import StreamingResponse
from starlette.types import Message

from bunraku.http.access_log import AccessLogMiddleware
from bunraku.http.problem_details import install_problem_handlers
from bunraku.http.unhandled_error import UnhandledErrorMiddleware
from bunraku.runtime.metrics import Metrics
from tests.credentials import SECRET, bearer_headers, make_token
from tests.disks import fill_disk, mount_small_disk, remount_read_only
from tests.servers import make_bvh_clip, run_server
from tests.time_limit import HANG_TIMEOUT_S


def create_app() -> FastAPI:
    app = FastAPI()
    install_problem_handlers(app)
    app.add_middleware(UnhandledErrorMiddleware)
    app.add_middleware(AccessLogMiddleware, metrics=Metrics(), clock=lambda: 0)

    @app.get("/errno/{number}")
    async def fail(number: int) -> None:
        raise OSError(number, "/srv/private/path") if number else LookupError("10.0.0.7")

    @app.get("/stream")
    async def stream() -> StreamingResponse:
        async def parts() -> AsyncIterator[bytes]:
            yield b"first"
            raise LookupError("10.0.0.7")

        return StreamingResponse(parts())

    @app.post("/body")
    async def read(request: Request) -> int:
        return sum([len(chunk) async for chunk in request.stream()])

    return app


@pytest.mark.parametrize(
    ("number", "status"),
    [
        (0, 500),
        (errno.ENOSPC, 507),
        (errno.EDQUOT, 507),
        (errno.EROFS, 503),
        (errno.EACCES, 503),
        (errno.EIO, 503),
        (errno.EMFILE, 503),
        (errno.ECHILD, 500),
    ],
)
async def test_unexpected_error_is_a_problem_and_logged_once(
    number: int, status: int, caplog: pytest.LogCaptureFixture
) -> None:
    caplog.set_level(logging.INFO)
    async with httpx2.AsyncClient(transport=httpx2.ASGITransport(create_app()), base_url="http://stage") as http:
        response = await http.get(f"/errno/{number}", headers={"X-Request-Id": "request-1"})
    assert response.status_code == response.json()["status"] == status
    assert response.headers["content-type"] == "application/problem+json"
    assert response.json()["request_id"] == response.headers["x-request-id"] == "request-1"
    assert "private" not in response.text
    assert "10.0.0.7" not in response.text
    assert ("retry-after" in response.headers) == (status == 503)
    tracebacks = [record for record in caplog.records if record.exc_info]
    assert len(tracebacks) == 1
    assert [record.status for record in caplog.records if record.message == "request"] == [status]  # type: ignore[attr-defined]


async def test_error_after_the_start_of_a_response_ends_it(caplog: pytest.LogCaptureFixture) -> None:
    sent: list[Message] = []

    async def send(message: Message) -> None:
        sent.append(message)

    async def receive() -> Message:
        # the client stays connected
        await asyncio.Event().wait()
        raise AssertionError

    scope = {"type": "http", "method": "GET", "path": "/stream", "headers": [], "query_string": b""}
    await create_app()(scope, receive, send)
    assert [message["type"] for message in sent] == ["http.response.start", "http.response.body"]
    assert len([record for record in caplog.records if record.exc_info]) == 1


async def test_client_that_disconnects_in_its_body_is_no_error(caplog: pytest.LogCaptureFixture) -> None:
    caplog.set_level(logging.INFO)
    messages: list[Message] = [
        {"type": "http.request", "body": b"part", "more_body": True},
        {"type": "http.disconnect"},
    ]
    sent: list[Message] = []

    async def send(message: Message) -> None:
        sent.append(message)

    async def receive() -> Message:
        return messages.pop(0)

    scope = {"type": "http", "method": "POST", "path": "/body", "headers": [], "query_string": b""}
    await create_app()(scope, receive, send)
    assert sent == []
    assert [record.exc_info for record in caplog.records] == [None]
    assert caplog.records[0].status == 499  # type: ignore[attr-defined]


def test_read_only_data_folder_is_a_503(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    host = bearer_headers(make_token())
    with mount_small_disk(tmp_path / "disk", "size=8m") as disk:
        with run_server(disk / "data", secret=SECRET) as url:
            assert httpx2.get(f"{url}/v1/motions", headers=host).json()["items"] == []
        remount_read_only(disk)
        with (
            run_server(disk / "data", secret=SECRET) as url,
            httpx2.Client(base_url=url, timeout=HANG_TIMEOUT_S) as http,
        ):
            for temporary in (tempfile.gettempdir(), str(disk)):
                monkeypatch.setattr(tempfile, "tempdir", temporary)
                upload = http.post("/v1/motions?filename=a.bvh", headers=host, content=make_bvh_clip(0.5))
                assert upload.status_code == 503
                assert upload.headers["content-type"] == "application/problem+json"
                assert str(disk) not in upload.text
            assert http.get("/v1/motions", headers=host).json()["items"] == []
            assert http.get("/readyz", headers=host).status_code == 503


def test_full_temporary_folder_is_a_507(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with mount_small_disk(tmp_path / "disk") as disk, run_server(tmp_path / "data") as url:
        fill_disk(disk)
        monkeypatch.setattr(tempfile, "tempdir", str(disk))
        response = httpx2.post(f"{url}/v1/motions?filename=a.bvh", content=make_bvh_clip(0.5), timeout=HANG_TIMEOUT_S)
        assert response.status_code == 507
        assert response.headers["content-type"] == "application/problem+json"
        assert [path.name for path in disk.iterdir()] == ["filler"]
