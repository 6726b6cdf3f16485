"""Objects in a folder and in S3, of which a real server process is asked."""

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
    with run_s3_server(tmp_path_factory.mktemp("s3")) as owned:
        yield owned


@pytest.fixture
def s3(server: ServerProcess, monkeypatch: pytest.MonkeyPatch) -> str:
    """The address of a new bucket."""
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
    found: str = f"file://{tmp_path}/objects" if request.param == "file" else request.getfixturevalue("s3")
    return found


@pytest.mark.parametrize("size", [0, 1, 3_000_000])
async def test_what_was_put_is_there_until_it_is_removed(url: str, size: int) -> None:
    data = secrets.token_bytes(size)
    await ObjectStorage(url).put("some/object", data)
    again = ObjectStorage(url)
    assert await again.get("some/object") == data
    await again.put("some/object", b"other")
    assert await again.get("some/object") == b"other"
    await again.delete("some/object")
    await again.delete("some/object")
    assert await again.get("some/object") is None


async def test_a_library_keeps_motions_and_logs(url: str) -> None:
    encoded = encode_motion(random_motion(1.5, 30.0, 8), error_bounds_mm=(30.0,), grade="live")
    await MotionStore.open(url).put("m1", pack_motion("m1", encoded))
    library = MotionStore.open(url)
    stored = await library.get("m1")
    assert stored is not None
    assert len(stored.first_packets[0]) == 2
    assert await library.get("m2") is None
    await library.put_log("a-log_1", b"what was done")
    assert await library.get_log("a-log_1") == b"what was done"
    await library.remove_log("a-log_1")
    await library.remove_log("a-log_1")
    assert await library.get_log("a-log_1") is None
    await library.remove("m1")
    assert await MotionStore.open(url).get("m1") is None


async def assert_unavailable(objects: ObjectStorage) -> None:
    with pytest.raises(BackendUnavailable, match="the library"):
        await objects.put("object", b"data")
    with pytest.raises(BackendUnavailable):
        await objects.get("object")
    with pytest.raises(BackendUnavailable):
        await objects.delete("object")


async def test_a_server_that_stands_still_is_not_waited_for(server: ServerProcess, s3: str) -> None:
    objects = ObjectStorage(s3)
    await objects.put("kept", b"data")
    server.pause()
    try:
        await assert_unavailable(objects)
    finally:
        server.resume()
    assert await objects.get("kept") == b"data"


@pytest.mark.usefixtures("s3")
async def test_a_server_that_is_gone_is_unavailable_and_what_is_in_memory_is_there(tmp_path: Path) -> None:
    with run_s3_server(tmp_path) as other, pytest.MonkeyPatch.context() as patch:
        endpoint = f"http://127.0.0.1:{other.port}"
        patch.setenv("AWS_ENDPOINT_URL", endpoint)
        httpx2.put(f"{endpoint}/bucket").raise_for_status()
        objects, library = ObjectStorage("s3://bucket"), MotionStore.open("s3://bucket")
        encoded = encode_motion(random_motion(1.5, 30.0, 8), error_bounds_mm=(30.0,), grade="live")
        await library.put("m1", pack_motion("m1", encoded))
        assert await library.get("m1") is not None
        other.kill()
        await assert_unavailable(objects)
        assert await library.get("m1") is not None
        other.start()
        httpx2.put(f"{endpoint}/bucket").raise_for_status()
        await objects.put("object", b"data")
        assert await objects.get("object") == b"data"


@pytest.mark.usefixtures("s3")
async def test_a_bucket_that_is_not_there_takes_nothing() -> None:
    with pytest.raises(BackendUnavailable, match="nowhere"):
        await ObjectStorage("s3://nowhere").put("object", b"data")


@pytest.mark.parametrize("url", ["carrier-pigeon://loft", "s3", ""])
def test_what_is_no_address_is_refused(url: str) -> None:
    with pytest.raises(Exception, match=r"(?i)url|scheme"):
        ObjectStorage(url)
