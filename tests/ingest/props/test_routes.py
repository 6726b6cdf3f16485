from __future__ import annotations

import asyncio
import json
from pathlib import Path

import httpx2
import pytest

from bunraku.ingest.props.operation import MAX_FILE_BYTES
from bunraku.motion.readers.gltf_file import parse_gltf_file
from tests.props.samples import box_glb
from tests.servers import run_server
from tests.time_limit import HANG_TIMEOUT_S


def client(url: str) -> httpx2.AsyncClient:
    return httpx2.AsyncClient(base_url=url, timeout=HANG_TIMEOUT_S)


async def test_prop_is_stored_once_described_and_removed(server: str) -> None:
    async with client(server) as http:
        first = await http.post("/v1/props", params={"filename": "My staff.glb"}, content=box_glb())
        prop = first.json()
        assert (first.status_code, first.headers["location"]) == (201, f"/v1/props/{prop['id']}")
        assert (prop["name"], prop["triangles"], prop["size"]) == ("My staff", 12, [0.05, 0.6, 0.05])
        again = await http.post("/v1/props", params={"filename": "other.glb"}, content=box_glb())
        assert (again.status_code, again.json()) == (200, prop)
        assert (await http.get(f"/v1/props/{prop['id']}")).json() == prop
        assert prop in (await http.get("/v1/props", params={"limit": 200})).json()["items"]
        assert (await http.delete(f"/v1/props/{prop['id']}")).status_code == 204
        for method, path in (("GET", ""), ("GET", "/model"), ("DELETE", "")):
            missing = await http.request(method, f"/v1/props/{prop['id']}{path}")
            assert (missing.status_code, missing.json()["title"]) == (404, "No such prop")


async def test_model_is_immutable_and_compressed_for_those_who_accept_it(server: str) -> None:
    async with client(server) as http:
        prop = (await http.post("/v1/props", params={"filename": "a.glb"}, content=box_glb(0.07))).json()
        path = f"/v1/props/{prop['id']}/model"
        packed = await http.get(path, headers={"Accept-Encoding": "br, gzip"})
        plain = await http.get(path, headers={"Accept-Encoding": "identity"})
        assert (packed.headers["content-encoding"], int(packed.headers["content-length"])) == ("gzip", prop["bytes"])
        assert "content-encoding" not in plain.headers
        assert packed.content == plain.content
        assert len(parse_gltf_file(plain.content).items("meshes")) == 1
        assert plain.headers["content-type"] == "model/gltf-binary"
        assert "immutable" in plain.headers["cache-control"]
        known = await http.get(path, headers={"If-None-Match": plain.headers["etag"]})
        assert (known.status_code, known.content) == (304, b"")


async def test_wanted_length_and_grip_make_another_prop(server: str) -> None:
    async with client(server) as http:
        made = [
            (await http.post("/v1/props", params={"filename": "a.glb", **fit}, content=box_glb(0.03))).json()
            for fit in ({}, {"length": "1.2"}, {"grip": "bottom"})
        ]
        assert len({prop["id"] for prop in made}) == 3
        assert [max(prop["size"]) for prop in made] == [0.6, 1.2, 0.6]


@pytest.mark.parametrize(
    ("query", "content", "status", "title"),
    [
        ({"filename": "a.glb"}, b"glTF", 422, "Cut short"),
        ({"filename": "a.glb"}, b"", 422, "Not a glTF file"),
        ({"filename": "a.glb"}, box_glb(0.0, 0.5, 0.0), 422, "No surface"),
        ({}, box_glb(), 422, "Invalid request"),
        ({"filename": "a.glb", "length": "9"}, box_glb(), 422, "Invalid request"),
        ({"filename": "a.glb", "length": "nan"}, box_glb(), 422, "Invalid request"),
        ({"filename": "a.glb", "grip": "blade"}, box_glb(), 422, "Invalid request"),
    ],
)
async def test_bad_request_is_answered_with_its_reason(
    server: str, query: dict[str, str], content: bytes, status: int, title: str
) -> None:
    async with client(server) as http:
        refused = await http.post("/v1/props", params=query, content=content)
        assert (refused.status_code, refused.json()["title"]) == (status, title)


async def test_file_beyond_the_limit_is_refused_before_it_is_sent(server: str) -> None:
    address = httpx2.URL(server)
    reader, writer = await asyncio.open_connection(address.host, address.port)
    head = f"Host: {address.host}\r\nContent-Length: {MAX_FILE_BYTES + 1}\r\n\r\n"
    writer.write(b"POST /v1/props?filename=a.glb HTTP/1.1\r\n" + head.encode())
    answer = await asyncio.wait_for(reader.readuntil(b"}"), HANG_TIMEOUT_S)
    writer.close()
    status, _, rest = answer.partition(b"\r\n")
    problem = json.loads(rest.partition(b"\r\n\r\n")[2])
    assert b" 413 " in status
    assert problem["limit"] == MAX_FILE_BYTES
    assert "images" in problem["hint"]


async def test_pages_follow_one_another(tmp_path: Path) -> None:
    with run_server(tmp_path) as url:
        async with client(url) as http:
            made = [
                (await http.post("/v1/props", params={"filename": "a.glb"}, content=box_glb(width))).json()["id"]
                for width in (0.01, 0.02, 0.03)
            ]
            first = (await http.get("/v1/props", params={"limit": 2})).json()
            second = (await http.get("/v1/props", params={"limit": 2, "cursor": first["next"]})).json()
            assert [prop["id"] for prop in (*first["items"], *second["items"])] == made[::-1]
            assert second["next"] is None
            bad = await http.get("/v1/props", params={"cursor": "x"})
            assert (bad.status_code, bad.json()["field"]) == (422, "cursor")


async def test_same_file_at_the_same_time_is_one_prop(server: str) -> None:
    async with client(server) as http:
        uploads = (http.post("/v1/props", params={"filename": "a.glb"}, content=box_glb(0.09)) for _ in range(4))
        answers = await asyncio.gather(*uploads)
        assert len({answer.json()["id"] for answer in answers}) == 1
        assert sorted(answer.status_code for answer in answers) == [200, 200, 200, 201]
