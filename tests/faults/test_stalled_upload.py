"""Uploads that stop, to a real server: they end within a window, hold no worker and leave room for other subjects."""

from __future__ import annotations

import asyncio
import contextlib
import tempfile
from collections.abc import AsyncIterator, Iterator
from contextlib import AsyncExitStack, asynccontextmanager
from pathlib import Path
from urllib.parse import urlsplit

import httpx2
import pytest

from bunraku.http.access_control import Role
from bunraku.ingest.upload import MAX_UPLOADS_PER_HOLDER
from tests.credentials import SECRET, bearer_headers, make_token
from tests.servers import make_bvh_clip, run_server
from tests.time_limit import HANG_TIMEOUT_S

NAME = "upload-name-1"


@pytest.fixture(scope="module")
def patient(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    """Return the address of a server that waits long for stalled bodies."""
    with run_server(tmp_path_factory.mktemp("patient"), secret=SECRET, connects=0, body_seconds=HANG_TIMEOUT_S) as url:
        yield url


@pytest.fixture(scope="module")
def impatient(tmp_path_factory: pytest.TempPathFactory) -> Iterator[str]:
    with run_server(tmp_path_factory.mktemp("impatient"), secret=SECRET, connects=0, body_seconds=0.5) as url:
        yield url


def uploader(name: str) -> dict[str, str]:
    return bearer_headers(make_token(Role.INGEST, name))


def upload_files() -> list[Path]:
    return list(Path(tempfile.gettempdir()).glob("bunraku-upload-*"))


@asynccontextmanager
async def stalled_upload(
    url: str, subject: str, query: str = "", sent: bytes = b"x" * 400_000
) -> AsyncIterator[asyncio.StreamReader]:
    """Begin an upload of 60 MB, send `sent` and stop."""
    parts = urlsplit(url)
    reader, writer = await asyncio.open_connection(parts.hostname, parts.port)
    head = [f"POST /v1/motions?filename=a.bvh{query} HTTP/1.1", "Host: stage", "Content-Length: 60000000"]
    head += [f"{name}: {value}" for name, value in uploader(subject).items()]
    try:
        writer.write("\r\n".join([*head, "", ""]).encode() + sent)
        await writer.drain()
        yield reader
    finally:
        writer.close()


async def wait_for_uploads(count: int) -> None:
    async with asyncio.timeout(HANG_TIMEOUT_S):
        while len(upload_files()) != count:  # noqa: ASYNC110
            await asyncio.sleep(0.01)


async def read_response(reader: asyncio.StreamReader) -> bytes:
    async with asyncio.timeout(HANG_TIMEOUT_S):
        with contextlib.suppress(ConnectionError):
            return await reader.read(65_536)
    return b""


async def test_stopped_uploads_leave_room_for_other_subjects(patient: str) -> None:
    async with AsyncExitStack() as stack, httpx2.AsyncClient(base_url=patient, timeout=HANG_TIMEOUT_S) as http:
        for _ in range(MAX_UPLOADS_PER_HOLDER):
            await stack.enter_async_context(stalled_upload(patient, "mallory"))
        await wait_for_uploads(MAX_UPLOADS_PER_HOLDER)
        refused = await http.post("/v1/motions?filename=a.bvh", content=make_bvh_clip(0.2), headers=uploader("mallory"))
        assert refused.status_code == 503
        assert int(refused.headers["retry-after"]) > 0
        accepted = await http.post("/v1/motions?filename=a.bvh", content=make_bvh_clip(0.2), headers=uploader("aiko"))
        assert accepted.status_code == 201
    # the clients are gone: their files are too
    await wait_for_uploads(0)


async def test_stopped_upload_is_ended_after_one_window(impatient: str) -> None:
    async with stalled_upload(impatient, "mallory") as fast, stalled_upload(impatient, "mallory", sent=b"x") as slow:
        for reader in (fast, slow):
            assert (await read_response(reader)).startswith(b"HTTP/1.1 408")
    await wait_for_uploads(0)


async def test_upload_names_of_other_subjects_are_neither_blocked_nor_visible(patient: str) -> None:
    async with (
        stalled_upload(patient, "mallory", f"&upload={NAME}"),
        httpx2.AsyncClient(base_url=patient, timeout=HANG_TIMEOUT_S) as http,
    ):
        await wait_for_uploads(1)
        own = await http.get(f"/v1/uploads/{NAME}", headers=uploader("mallory"))
        assert (own.status_code, own.json()["stage"]) == (200, "receiving")
        assert (await http.get(f"/v1/uploads/{NAME}", headers=uploader("aiko"))).status_code == 404
        clip = make_bvh_clip(0.2)
        other = await http.post(f"/v1/motions?filename=a.bvh&upload={NAME}", content=clip, headers=uploader("aiko"))
        assert other.status_code in (200, 201)
        same = await http.post(f"/v1/motions?filename=a.bvh&upload={NAME}", content=clip, headers=uploader("mallory"))
        assert same.status_code == 409
    await wait_for_uploads(0)


async def test_missing_end_of_chunks_is_ended_after_one_window(impatient: str) -> None:
    parts = urlsplit(impatient)
    reader, writer = await asyncio.open_connection(parts.hostname, parts.port)
    head = ["POST /v1/motions?filename=a.bvh HTTP/1.1", "Host: stage", "Transfer-Encoding: chunked"]
    head += [f"{name}: {value}" for name, value in uploader("mallory").items()]
    clip = make_bvh_clip(0.2)
    writer.write("\r\n".join([*head, "", ""]).encode() + b"%x\r\n" % len(clip) + clip + b"\r\n")
    assert (await read_response(reader)).startswith(b"HTTP/1.1 408")
    writer.close()
    await wait_for_uploads(0)
