"""Requests that exceed a limit of size, rate or time, to a real server: a 4xx with a reason, and nothing is stored."""

from __future__ import annotations

import asyncio
import contextlib
import gzip
import json
import tempfile
import zlib
from collections.abc import Iterator
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

import httpx2
import pytest
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.typing import Origin, Subprotocol

from bunraku.http import protocol
from bunraku.http.access_control import Role
from bunraku.wire.messages import MAX_CLIENT_MESSAGE_BYTES, SUBPROTOCOL
from tests.connection_limit import limit_connections
from tests.credentials import SECRET, bearer_headers, make_token
from tests.servers import make_bvh_clip, run_server
from tests.time_limit import HANG_TIMEOUT_S


@pytest.fixture(scope="module")
def guarded(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    options: dict[str, Any] = {"secret": SECRET, "body_seconds": HANG_TIMEOUT_S, "quota_motions": 2}
    with run_server(tmp_path_factory.mktemp("limits"), upload_bytes=1 << 20, **options) as url:
        yield url


@pytest.fixture(scope="module")
def impatient(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Return a server that rejects slow bodies after a second."""
    with run_server(tmp_path_factory.mktemp("impatient"), secret=SECRET, body_seconds=1.0) as url:
        yield url


def temporary_files() -> set[Path]:
    """Return the entries of the temporary folder."""
    return set(Path(tempfile.gettempdir()).iterdir())


def motion_count(url: str) -> int:
    return len(httpx2.get(f"{url}/v1/motions", headers=bearer_headers(make_token())).json()["items"])


async def send_raw(url: str, *pieces: bytes, interval_s: float = 0.0) -> bytes:
    """Send `pieces` one by one and return the bytes received until the server closes the connection."""
    parts = urlsplit(url)
    reader, writer = await asyncio.open_connection(parts.hostname, parts.port)

    async def send() -> None:
        with contextlib.suppress(OSError):
            for piece in pieces:
                writer.write(piece)
                await writer.drain()
                await asyncio.sleep(interval_s)

    sending = asyncio.create_task(send())
    try:
        async with asyncio.timeout(HANG_TIMEOUT_S):
            response = b""
            with contextlib.suppress(OSError):
                while more := await reader.read(65_536):
                    response += more
            return response
    finally:
        sending.cancel()
        await asyncio.gather(sending, return_exceptions=True)
        writer.close()


async def read_until_closed(socket: ClientConnection) -> None:
    """Read until the server closes the connection."""
    while True:
        await socket.recv()


def request_head(method: str, path: str, *lines: str, bearer_token: str | None = None) -> bytes:
    options = [f"{name}: {value}" for name, value in bearer_headers(bearer_token or make_token()).items()]
    return "\r\n".join([f"{method} {path} HTTP/1.1", "Host: stage", *options, *lines, "", ""]).encode()


def response_status(response: bytes) -> int:
    return int(response.split(b" ", 2)[1])


async def test_slow_upload_is_rejected_with_408_and_leaves_nothing(impatient: str) -> None:
    before, files_before = motion_count(impatient), temporary_files()
    head = request_head("POST", "/v1/motions?filename=a.bvh", "Content-Length: 100000")
    response = await send_raw(impatient, head, *[b"x"] * 1_000, interval_s=0.05)
    assert response_status(response) == 408
    assert b"too slowly" in response
    chunked = request_head("POST", "/v1/motions?filename=a.bvh", "Transfer-Encoding: chunked")
    assert response_status(await send_raw(impatient, chunked, *[b"1\r\nx\r\n"] * 1_000, interval_s=0.05)) == 408
    # an upload that stops
    assert response_status(await send_raw(impatient, head, b"x" * 500)) == 408
    assert motion_count(impatient) == before
    assert temporary_files() <= files_before


@pytest.mark.parametrize("path", ["/v1/sessions", "/v1/solve", "/v1/shares"])
async def test_slow_body_is_rejected_with_408(impatient: str, path: str) -> None:
    head = request_head("POST", path, "Content-Length: 1000", "Content-Type: application/json")
    assert response_status(await send_raw(impatient, head, *[b" "] * 900, interval_s=0.05)) == 408


async def test_slow_request_head_is_closed_without_delaying_others(
    impatient: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(protocol, "HEADER_TIMEOUT_S", 1.0)
    slow_requests = [
        asyncio.create_task(send_raw(impatient, b"GET /v1/health HTTP/1.1\r\n", *[b"a"] * 1_000, interval_s=0.05))
    ]
    slow_requests.append(asyncio.create_task(send_raw(impatient)))
    async with httpx2.AsyncClient(base_url=impatient) as http:
        assert (await http.get("/v1/health")).status_code == 200
    assert await asyncio.gather(*slow_requests) == [b"", b""]


async def test_oversized_request_head_is_rejected(guarded: str) -> None:
    response = await send_raw(
        guarded, b"GET /v1/health HTTP/1.1\r\nHost: stage\r\n", *[b"a: " + b"b" * 1_000 + b"\r\n"] * 100
    )
    assert response_status(response) in (400, 431)
    assert response_status(await send_raw(guarded, b"GET /" + b"a" * 100_000)) in (400, 414, 431)


@pytest.mark.parametrize(
    ("path", "max_bytes"),
    [
        ("/v1/motions?filename=a.bvh", 1 << 20),
        ("/v1/sessions", 4 << 10),
        ("/v1/shares", 4 << 10),
        ("/v1/tickets", 4 << 10),
        ("/v1/solve", 1 << 20),
        ("/v1/motions/none/scene", 8 << 20),
        ("/v1/sessions/none/recordings", 8 << 20),
    ],
)
async def test_oversized_body_is_rejected_before_it_is_read(guarded: str, path: str, max_bytes: int) -> None:
    before = motion_count(guarded)
    response = await send_raw(
        guarded, request_head("POST", path, f"Content-Length: {max_bytes + 1}", "Content-Type: application/json")
    )
    assert response_status(response) == 413
    assert b"application/problem+json" in response
    assert motion_count(guarded) == before


async def test_invalid_token_is_rejected_before_the_body_is_read(guarded: str) -> None:
    for path in ("/v1/motions?filename=a.bvh", "/v1/solve"):
        head = request_head("POST", path, "Content-Length: 1000000", "Expect: 100-continue", bearer_token="guess")
        response = await send_raw(guarded, head, b"x" * 1_000)
        assert response_status(response) == 401


@pytest.mark.parametrize("compressed", [gzip.compress(b" " * 50_000_000), zlib.compress(b" " * 50_000_000)])
@pytest.mark.parametrize("path", ["/v1/sessions", "/v1/solve", "/v1/motions?filename=a.bvh"])
async def test_compressed_body_is_rejected(guarded: str, path: str, compressed: bytes) -> None:
    before = motion_count(guarded)
    options = {"Content-Encoding": "gzip", "Content-Type": "application/json", **bearer_headers(make_token())}
    async with httpx2.AsyncClient(base_url=guarded, timeout=HANG_TIMEOUT_S) as http:
        response = await http.post(path, content=compressed, headers=options)
    assert 400 <= response.status_code < 500
    assert response.headers["content-type"] == "application/problem+json"
    assert motion_count(guarded) == before


@pytest.mark.parametrize(
    "body",
    [b"[" * 60_000, b'{"motion":' * 6_000, b"1" * 60_000, b'{"seconds":' + b"9" * 5_000 + b"}", b'"\\ud800"', b"\xff"],
)
@pytest.mark.parametrize("path", ["/v1/sessions", "/v1/shares", "/v1/solve"])
async def test_hostile_json_is_rejected_with_4xx(guarded: str, path: str, body: bytes) -> None:
    options = {"Content-Type": "application/json", **bearer_headers(make_token())}
    async with httpx2.AsyncClient(base_url=guarded, timeout=HANG_TIMEOUT_S) as http:
        response = await http.post(path, content=body, headers=options)
    assert 400 <= response.status_code < 500
    json.loads(response.text)


async def test_too_many_handshakes_are_rejected_with_429(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with run_server(tmp_path, secret=SECRET, connects=limit_connections(monkeypatch, 20)) as url:
        address = url.replace("http", "ws") + "/v1/motions/none/stream"

        async def connect_repeatedly() -> None:
            for _ in range(40):
                async with connect(
                    address, subprotocols=[Subprotocol(SUBPROTOCOL)], additional_headers=bearer_headers(make_token())
                ) as socket:
                    with contextlib.suppress(ConnectionClosed):
                        await socket.recv()

        with pytest.raises(InvalidStatus) as refused:
            await connect_repeatedly()
        assert refused.value.response.status_code == 429
        assert refused.value.response.headers["Retry-After"] == "1"
        # requests with a token are still accepted
        assert (await asyncio.to_thread(motion_count, url)) >= 0


@pytest.mark.parametrize("origin", ["https://evil.example", "null", "http://[::1"])
async def test_websocket_from_a_foreign_origin_is_rejected(tmp_path: Path, origin: str) -> None:
    with run_server(tmp_path) as url:
        address = url.replace("http", "ws") + "/v1/sessions/none/control"
        with pytest.raises(InvalidStatus) as refused:
            await connect(address, subprotocols=[Subprotocol(SUBPROTOCOL)], origin=Origin(origin))
        assert refused.value.response.status_code == 403
        async with connect(address, subprotocols=[Subprotocol(SUBPROTOCOL)], origin=Origin(url)) as socket:
            with pytest.raises(ConnectionClosed) as closed:
                await read_until_closed(socket)
        assert closed.value.rcvd is not None
        assert closed.value.rcvd.code == 4404


@pytest.mark.parametrize("path", ["stream", "control"])
async def test_oversized_frame_closes_with_1009(server: str, path: str) -> None:
    async with httpx2.AsyncClient(base_url=server, timeout=HANG_TIMEOUT_S) as http:
        motion = (await http.post("/v1/motions?filename=a.bvh", content=make_bvh_clip(1.0, 8))).json()["id"]
        session = (await http.post("/v1/sessions", json={"motion": motion})).json()["id"]
    address = server.replace("http", "ws") + f"/v1/sessions/{session}/{path}"
    for size in (MAX_CLIENT_MESSAGE_BYTES + 1, 10_000_000):
        async with connect(address, subprotocols=[Subprotocol(SUBPROTOCOL)]) as socket:
            with contextlib.suppress(ConnectionClosed):
                await socket.send(b"\x40" * size)
            with pytest.raises(ConnectionClosed) as closed:
                await read_until_closed(socket)
            assert closed.value.rcvd is None or closed.value.rcvd.code == 1009


def test_motion_quota_is_counted_per_user(guarded: str) -> None:
    with httpx2.Client(base_url=guarded, timeout=HANG_TIMEOUT_S) as http:
        aiko, ben = (bearer_headers(make_token(Role.INGEST, name)) for name in ("aiko", "ben"))
        before = motion_count(guarded)
        created = [
            http.post("/v1/motions?filename=a.bvh", content=make_bvh_clip(0.5, 40 + seed), headers=aiko).json()["id"]
            for seed in range(2)
        ]
        third = http.post("/v1/motions?filename=a.bvh", content=make_bvh_clip(0.5, 42), headers=aiko)
        assert (third.status_code, third.json()["title"]) == (403, "Quota used up")
        assert "2 motions" in third.json()["detail"]
        light = {"time": 0, "position": [0, 1, 0], "colour": [1, 1, 1], "intensity": 1}
        scene = http.post(f"/v1/motions/{created[0]}/scene", json={"lights": [[light]]}, headers=aiko)
        assert scene.json()["title"] == "Quota used up"
        assert motion_count(guarded) == before + 2
        # uploading an existing motion is free for another user, whose quota is separate
        again = http.post("/v1/motions?filename=a.bvh", content=make_bvh_clip(0.5, 42), headers=ben)
        assert again.status_code == 201
        http.delete(f"/v1/motions/{created[0]}", headers=aiko)
        assert http.post("/v1/motions?filename=a.bvh", content=make_bvh_clip(0.5, 43), headers=aiko).status_code == 201


def test_total_byte_quota_applies_without_a_secret(tmp_path: Path) -> None:
    with run_server(tmp_path, total_bytes=9_000) as url, httpx2.Client(base_url=url, timeout=HANG_TIMEOUT_S) as http:
        responses = [
            http.post("/v1/motions?filename=a.bvh", content=make_bvh_clip(1.0, 60 + seed)) for seed in range(8)
        ]
        assert responses[0].status_code == 201
        assert responses[-1].status_code == 403
        assert "9000 bytes" in responses[-1].json()["detail"]
        motions = len(http.get("/v1/motions").json()["items"])
        assert motions == sum(response.status_code == 201 for response in responses)
        assert len(list((tmp_path / "library").rglob("*.*"))) <= motions
