"""Objects in a folder and on a real S3 server."""

from __future__ import annotations

import secrets
from collections.abc import Iterator
from pathlib import Path

import httpx2
import pytest

from bunraku.codec.container import pack_motion
from bunraku.codec.motion_encoder import encode_motion
from bunraku.runtime.availability import BackendUnavailable
from bunraku.storage.motion_store import MotionStore
from bunraku.storage.object_storage import ObjectStorage
from tests.processes import ServerProcess, run_s3_server
from tests.vectors.blocks import random_motion


@pytest.fixture(scope="module")
def server(tmp_path_factory: pytest.TempPathFactory) -> Iterator[ServerProcess]:
    with run_s3_server(tmp_path_factory.mktemp("s3")) as process:
        yield process


@pytest.fixture
def s3(server: ServerProcess, monkeypatch: pytest.MonkeyPatch) -> str:
    """Return the URL of a new bucket."""
    endpoint = f"http://127.0.0.1:{server.port}"
    for name, value in {
        "AWS_ENDPOINT_URL": endpoint,
        "AWS_ACCESS_KEY_ID": "key",
        "AWS_SECRET_ACCESS_KEY": "secret",
        "AWS_REGION": "us-east-1",
    }.items():
        monkeypatch.setenv(name, value)
    bucket = f"b{secrets.token_hex(6)}"
    httpx2.put(f"{endpoint}/{bucket}").raise_for_status()
    return f"s3://{bucket}/a/prefix"


@pytest.fixture(params=["file", "s3"])
def url(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    url: str = f"file://{tmp_path}/objects" if request.param == "file" else request.getfixturevalue("s3")
    return url


@pytest.mark.parametrize("size", [0, 1, 3_000_000])
async def test_object_exists_until_it_is_deleted(url: str, size: int) -> None:
    data = secrets.token_bytes(size)
    await ObjectStorage(url).put("some/object", data)
    reopened = ObjectStorage(url)
    assert await reopened.get("some/object") == data
    await reopened.put("some/object", b"other")
    assert await reopened.get("some/object") == b"other"
    await reopened.delete("some/object")
    await reopened.delete("some/object")
    assert await reopened.get("some/object") is None


async def test_file_is_stored_as_an_object_and_copied_back(url: str, tmp_path: Path) -> None:
    data, source, target = secrets.token_bytes(12_000_000), tmp_path / "source", tmp_path / "target"
    source.write_bytes(data)
    await ObjectStorage(url).put_file("some/object", source)
    assert await ObjectStorage(url).get("some/object") == data
    assert await ObjectStorage(url).copy("some/object", target)
    assert target.read_bytes() == data
    assert not await ObjectStorage(url).copy("no/object", target)


async def test_motion_store_stores_motions_and_logs(url: str) -> None:
    encoded = encode_motion(random_motion(1.5, 30.0, 8), error_bounds_mm=(30.0,), grade="live")
    await MotionStore.open(url).put("m1", pack_motion("m1", encoded))
    store = MotionStore.open(url)
    stored = await store.get("m1")
    assert stored is not None
    assert len(stored.first_packets[0]) == 2
    assert await store.get("m2") is None
    await store.put_log("a-log_1", b"log bytes")
    assert await store.get_log("a-log_1") == b"log bytes"
    await store.remove_log("a-log_1")
    await store.remove_log("a-log_1")
    assert await store.get_log("a-log_1") is None
    await store.remove("m1")
    assert await MotionStore.open(url).get("m1") is None


async def assert_unavailable(objects: ObjectStorage, tmp_path: Path) -> None:
    with pytest.raises(BackendUnavailable, match="the library"):
        await objects.put("object", b"data")
    with pytest.raises(BackendUnavailable):
        await objects.get("object")
    with pytest.raises(BackendUnavailable):
        await objects.copy("object", tmp_path / "target")
    with pytest.raises(BackendUnavailable):
        await objects.delete("object")


async def test_suspended_server_is_unavailable_until_resumed(server: ServerProcess, s3: str, tmp_path: Path) -> None:
    objects = ObjectStorage(s3)
    await objects.put("kept", b"data")
    server.pause()
    try:
        await assert_unavailable(objects, tmp_path)
    finally:
        server.resume()
    assert await objects.get("kept") == b"data"


@pytest.mark.usefixtures("s3")
async def test_killed_server_is_unavailable_but_cached_motions_are_served(tmp_path: Path) -> None:
    with run_s3_server(tmp_path) as other_server, pytest.MonkeyPatch.context() as patch:
        endpoint = f"http://127.0.0.1:{other_server.port}"
        patch.setenv("AWS_ENDPOINT_URL", endpoint)
        httpx2.put(f"{endpoint}/bucket").raise_for_status()
        objects, store = ObjectStorage("s3://bucket"), MotionStore.open("s3://bucket")
        encoded = encode_motion(random_motion(1.5, 30.0, 8), error_bounds_mm=(30.0,), grade="live")
        await store.put("m1", pack_motion("m1", encoded))
        assert await store.get("m1") is not None
        other_server.kill()
        await assert_unavailable(objects, tmp_path)
        assert await store.get("m1") is not None
        other_server.start()
        httpx2.put(f"{endpoint}/bucket").raise_for_status()
        await objects.put("object", b"data")
        assert await objects.get("object") == b"data"


@pytest.mark.usefixtures("s3")
async def test_missing_bucket_is_unavailable() -> None:
    with pytest.raises(BackendUnavailable, match="nowhere"):
        await ObjectStorage("s3://nowhere").put("object", b"data")


@pytest.mark.parametrize("url", ["carrier-pigeon://loft", "s3", ""])
def test_invalid_url_is_rejected(url: str) -> None:
    with pytest.raises(Exception, match=r"(?i)url|scheme"):
        ObjectStorage(url)
