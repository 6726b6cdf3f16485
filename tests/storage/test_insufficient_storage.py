"""Object store and server on a full disk."""

from __future__ import annotations

import asyncio
import errno
import hashlib
import random
import shutil
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path

import asyncpg
import httpx2
import pytest

from bunraku.runtime.availability import BackendUnavailable
from bunraku.runtime.insufficient_storage import insufficient_storage, is_disk_full, translate_disk_full
from bunraku.runtime.problem import ProblemError
from bunraku.storage.catalogue_sql import SqlCatalogue
from bunraku.storage.object_storage import ObjectStorage
from bunraku.storage.record import CatalogueEntry
from tests.disks import fill_disk, mount_small_disk
from tests.processes import ServerProcess
from tests.servers import make_bvh_clip, run_server
from tests.time_limit import HANG_TIMEOUT_S


@pytest.fixture
def small(tmp_path: Path) -> Iterator[Path]:
    """Return a folder with 1 MiB of space."""
    with mount_small_disk(tmp_path / "small") as folder:
        yield folder


def file_names(folder: Path) -> list[str]:
    return [file.name for file in folder.rglob("*") if file.is_file()]


def test_disk_full_error_becomes_a_507() -> None:
    with pytest.raises(ProblemError) as raised, translate_disk_full("this server"):
        raise OSError(errno.ENOSPC, "No space left on device")
    assert raised.value.status == 507
    assert "this server" in raised.value.detail
    with pytest.raises(PermissionError), translate_disk_full("this server"):
        raise PermissionError(errno.EACCES, "no")
    assert not is_disk_full(ValueError("os error 2)"))
    assert insufficient_storage("the library").extra["hint"]


async def test_failed_put_keeps_the_previous_object(small: Path) -> None:
    objects = ObjectStorage(f"file://{small}")
    await objects.put("a/kept", b"x" * 400_000)
    for name in ("a/kept", "a/other"):
        with pytest.raises(ProblemError) as raised:
            await objects.put(name, b"y" * 900_000)
        assert raised.value.status == 507
    assert await objects.get("a/kept") == b"x" * 400_000
    assert await objects.get("a/other") is None
    assert file_names(small) == ["kept"]
    await objects.put("a/other", b"y" * 400_000)


async def test_upload_to_a_full_disk_leaves_stored_motions_intact(small: Path, tmp_path: Path) -> None:
    with run_server(tmp_path / "data", library=f"file://{small}") as url:
        async with httpx2.AsyncClient(base_url=url, timeout=HANG_TIMEOUT_S) as http:
            stored = await http.post("/v1/motions", params={"filename": "a.bvh"}, content=make_bvh_clip(1.0, 1))
            assert stored.status_code == 201
            filler = small / "filler"
            with pytest.raises(OSError, match="No space"):
                filler.write_bytes(bytes(2 << 20))
            refused = await http.post("/v1/motions", params={"filename": "b.bvh"}, content=make_bvh_clip(1.0, 2))
            assert refused.status_code == 507
            assert refused.headers["content-type"] == "application/problem+json"
            assert [item["id"] for item in (await http.get("/v1/motions")).json()["items"]] == [stored.json()["id"]]
            before = await http.get(f"/v1/motions/{stored.json()['id']}/blocks/0/0")
            assert before.status_code == 200
            digest = hashlib.sha256(before.content).digest()
            filler.unlink()
            retried = await http.post("/v1/motions", params={"filename": "b.bvh"}, content=make_bvh_clip(1.0, 2))
            assert retried.status_code == 201
            after = await http.get(f"/v1/motions/{stored.json()['id']}/blocks/0/0")
            assert hashlib.sha256(after.content).digest() == digest


@contextmanager
def run_refusing_store(status: int, code: str) -> Iterator[str]:
    """Run an HTTP server that refuses every object as an S3 store does; return its address."""

    class RefusingHandler(BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"

        def do_PUT(self) -> None:
            self.rfile.read(int(self.headers["Content-Length"]))
            body = f"<?xml version='1.0'?>\n<Error>\n<Code>{code}</Code>\n<Message>no</Message></Error>".encode()
            self.send_response(status)
            self.send_header("Content-Length", str(len(body)))
            self.end_headers()
            self.wfile.write(body)

        def log_message(self, format: str, *args: object) -> None:  # noqa: A002
            """Log nothing."""

    with ThreadingHTTPServer(("127.0.0.1", 0), RefusingHandler) as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        try:
            yield f"http://127.0.0.1:{server.server_port}"
        finally:
            server.shutdown()
            thread.join()


@pytest.mark.parametrize(
    ("status", "code", "is_full"),
    [
        (507, "XMinioStorageFull", True),
        (507, "Unknown", True),
        (400, "XMinioAdminBucketQuotaExceeded", True),
        (403, "QuotaExceeded", True),
        (403, "AccessDenied", False),
        (503, "SlowDown", False),
    ],
)
async def test_refusal_of_an_object_store_is_a_problem(
    status: int, code: str, is_full: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    with run_refusing_store(status, code) as address:
        for name, value in (("ENDPOINT_URL", address), ("ACCESS_KEY_ID", "k"), ("SECRET_ACCESS_KEY", "s")):
            monkeypatch.setenv(f"AWS_{name}", value)
        objects = ObjectStorage("s3://bucket/prefix")
        if is_full:
            with pytest.raises(ProblemError) as raised:
                await objects.put("a", b"1")
            assert raised.value.status == 507
        else:
            with pytest.raises(BackendUnavailable):
                await objects.put("a", b"1")


async def _open_small_database(server: ServerProcess, folder: Path) -> str:
    connection = await asyncpg.connect(host="127.0.0.1", port=server.port, user="postgres", database="postgres")
    await connection.execute(f"CREATE TABLESPACE small LOCATION '{folder}'")
    await connection.execute("CREATE DATABASE small TABLESPACE small")
    await connection.close()
    return f"postgresql://postgres@127.0.0.1:{server.port}/small"


async def _drop_small_database(server: ServerProcess) -> None:
    connection = await asyncpg.connect(host="127.0.0.1", port=server.port, user="postgres", database="postgres")
    await connection.execute("DROP DATABASE IF EXISTS small WITH (FORCE)")
    await connection.execute("DROP TABLESPACE IF EXISTS small")
    await connection.close()


async def test_full_disk_of_postgresql_is_a_problem(postgres_server: ServerProcess) -> None:
    with mount_small_disk(postgres_server.folder / "small", "size=24m,mode=777") as disk:
        shutil.chown(disk, postgres_server.folder.owner())
        catalogue = await SqlCatalogue.open(await _open_small_database(postgres_server, disk))
        try:
            await catalogue.add_motion(CatalogueEntry("kept", 1, {}))
            filler = await asyncio.to_thread(fill_disk, disk)
            # incompressible, so that it needs new pages
            large = CatalogueEntry("large", 2, {"name": random.Random(1).randbytes(400_000).hex()})
            with pytest.raises(ProblemError) as raised:
                await catalogue.add_motion(large)
            assert raised.value.status == 507
            assert raised.value.detail.startswith("the catalogue")
            assert [entry.id for entry in (await catalogue.list_motions(9))[0]] == ["kept"]
            filler.unlink()
            assert await catalogue.add_motion(large)
        finally:
            await catalogue.close()
            await _drop_small_database(postgres_server)
