from __future__ import annotations

import gzip
from pathlib import Path
from typing import Any

import httpx2
import pytest
from starlette.exceptions import HTTPException

from bunraku.page_files import PIECE_BYTES, accepted_encodings, create_page_app

SCRIPT = b"export const answer = 42;" * 100
STORED = {
    None: SCRIPT,
    "gzip": gzip.compress(SCRIPT, mtime=0),
    # no real Brotli: the server sends what it finds
    "br": b"brotli",
}
"""Content of the stored files, by encoding."""


@pytest.fixture
def page(tmp_path: Path) -> Path:
    """A page with a compressed script, and a picture that is not compressed."""
    (tmp_path / "assets").mkdir()
    (tmp_path / "index.html").write_text("<!doctype html>")
    script = tmp_path / "assets" / "index-abc.js"
    script.write_bytes(SCRIPT)
    for encoding, suffix in (("gzip", ".gz"), ("br", ".br")):
        Path(f"{script}{suffix}").write_bytes(STORED[encoding])
    (tmp_path / "assets" / "seal.png").write_bytes(b"\x89PNG")
    return tmp_path


def open_client(page: Path) -> httpx2.AsyncClient:
    return httpx2.AsyncClient(transport=httpx2.ASGITransport(create_page_app(page)), base_url="http://page")


@pytest.mark.parametrize(
    ("header", "encoding"),
    [
        ("", None),
        ("identity", None),
        ("gzip, deflate", "gzip"),
        ("gzip, deflate, br, zstd", "br"),
        ("br;q=0, GZIP;q=0.1", "gzip"),
        ("br; q=0.000, gzip;q=0", None),
    ],
)
async def test_script_is_sent_in_the_best_accepted_encoding(page: Path, header: str, encoding: str | None) -> None:
    async with (
        open_client(page) as client,
        client.stream("GET", "/assets/index-abc.js", headers={"Accept-Encoding": header}) as response,
    ):
        raw = b"".join([chunk async for chunk in response.aiter_raw()])
    assert response.status_code == 200
    assert response.headers.get("content-encoding") == encoding
    assert response.headers["vary"] == "Accept-Encoding"
    assert response.headers["content-type"].startswith("text/javascript")
    assert len(raw) == int(response.headers["content-length"])
    assert raw == STORED[encoding]


async def test_each_encoding_is_revalidated_by_its_own_tag(page: Path) -> None:
    async with open_client(page) as client:
        tags = {}
        for header in ("identity", "gzip"):
            first = await client.get("/assets/index-abc.js", headers={"Accept-Encoding": header})
            tags[header] = first.headers["etag"]
            again = await client.get(
                "/assets/index-abc.js", headers={"Accept-Encoding": header, "If-None-Match": tags[header]}
            )
            assert again.status_code == 304
            assert again.headers["vary"] == "Accept-Encoding"
            assert "immutable" in again.headers["cache-control"]
    assert tags["gzip"] != tags["identity"]


async def test_head_has_the_headers_of_get_without_the_content(page: Path) -> None:
    async with open_client(page) as client:
        # httpx2 would decode the missing content of a HEAD response with Brotli, where that is installed
        accepted = {"Accept-Encoding": "gzip"}
        head, get = [await client.request(name, "/assets/index-abc.js", headers=accepted) for name in ("HEAD", "GET")]
    assert head.content == b""
    assert head.headers == get.headers


async def test_changed_file_is_read_again(page: Path) -> None:
    async with open_client(page) as client:
        before = await client.get("/")
        (page / "index.html").write_text("<!doctype html><title>rebuilt</title>")
        after = await client.get("/", headers={"If-None-Match": before.headers["etag"]})
        assert (after.status_code, after.text) == (200, "<!doctype html><title>rebuilt</title>")
        assert (await client.get("/", headers={"If-None-Match": after.headers["etag"]})).status_code == 304


async def test_large_file_is_sent_in_pieces(page: Path) -> None:
    content = bytes(range(256)) * 1_000
    (page / "assets" / "large.bin").write_bytes(content)
    pieces: list[bytes] = []

    async def send(message: Any) -> None:
        pieces.append(message.get("body", b""))

    async def receive() -> Any:
        raise AssertionError("a request without a body")

    scope = {"type": "http", "method": "GET", "path": "/assets/large.bin", "headers": [], "root_path": ""}
    await create_page_app(page)(scope, receive, send)
    assert b"".join(pieces) == content
    assert max(map(len, pieces)) <= PIECE_BYTES


async def test_paths_outside_the_page_are_not_found(page: Path) -> None:
    (page.parent / "secret").write_text("secret")
    async with open_client(page) as client:
        for path in ("/../secret", "/assets/..%2f..%2fsecret", "/%2e%2e/secret", "/assets", "/nothing", "/a%00b"):
            with pytest.raises(HTTPException) as raised:
                await client.get(path)
            assert raised.value.status_code == 404, path


async def test_files_without_a_copy_are_sent_as_they_are(page: Path) -> None:
    async with open_client(page) as client:
        for path in ("/", "/assets/seal.png"):
            response = await client.get(path, headers={"Accept-Encoding": "gzip, br"})
            assert response.status_code == 200
            assert "content-encoding" not in response.headers


async def test_page_that_is_not_built_says_what_to_do(tmp_path: Path) -> None:
    async with open_client(tmp_path) as client:
        response = await client.get("/")
    assert response.status_code == 503
    assert "make setup" in response.text


def test_unknown_encodings_are_ignored() -> None:
    assert accepted_encodings("zstd, *;q=0.5, compress") == []
    assert accepted_encodings("gzip;q=1.0,br;q=0.8") == ["br", "gzip"]
    assert accepted_encodings(",;,;q=,gzip;q") == ["gzip"]
