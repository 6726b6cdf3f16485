from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path

import httpx2
import pytest

from bunraku.runtime.display_text import clean_text
from tests.servers import make_bvh_clip, run_server
from tests.time_limit import HANG_TIMEOUT_S


async def post(url: str, data: bytes, filename: str = "clip.bvh") -> httpx2.Response:
    async with httpx2.AsyncClient(base_url=url, timeout=HANG_TIMEOUT_S) as http:
        return await http.post("/v1/motions", params={"filename": filename}, content=data)


async def get(url: str, path: str) -> httpx2.Response:
    async with httpx2.AsyncClient(base_url=url, timeout=HANG_TIMEOUT_S) as http:
        return await http.get(path)


async def test_upload_creates_a_motion_once(server: str) -> None:
    data = make_bvh_clip(seed=41)
    first = await post(server, data, "My dance.bvh")
    assert first.status_code == 201
    motion = first.json()
    assert first.headers["location"] == f"/v1/motions/{motion['id']}"
    assert motion["name"] == "My dance"
    assert motion["duration"] == pytest.approx(3.4)
    assert (motion["fps"], motion["frames"], motion["blocks"]) == (30, 102, 3)
    assert len(motion["joints"]) == 18
    assert motion["fit"]["mean_mm"] < 1
    assert len(motion["rates"]) >= 3
    repeated = await post(server, data, "other name.bvh")
    assert (repeated.status_code, repeated.json()) == (200, motion)
    assert (await get(server, f"/v1/motions/{motion['id']}")).json() == motion


HOSTILE = "\x1b]0;owned\x07\x00\u202e\u2066\u200b\x9b2J"
"""Text of which nothing can be seen."""


async def test_names_are_cleaned_where_they_enter(server: str) -> None:
    data = make_bvh_clip(seed=42).replace(b"skullbase", "skullbase\x07\u202e".encode())
    motion = (await post(server, data, f"{HOSTILE}人形\u3000👍🏽 か\u3099.bvh")).json()
    assert (motion["name"], motion["filename"]) == ("人形\u3000👍🏽 が", "人形\u3000👍🏽 が.bvh")
    assert motion["joints"]["skullbase"] == "skullbase"
    long = (await post(server, make_bvh_clip(seed=44), f"v1.{'踊' * 248}.bvh")).json()
    assert (long["name"], len(long["filename"])) == (f"v1.{'踊' * 197}", 255)
    unnamed = (await post(server, make_bvh_clip(seed=43), HOSTILE)).json()
    assert (unnamed["name"], unnamed["filename"]) == ("unnamed", "unnamed")


async def test_problem_that_quotes_a_request_or_a_file_is_cleaned(server: str) -> None:
    rejected = await post(server, f"HIERARCHY\nROOT Hips{HOSTILE}\n{{ WRONG{HOSTILE}".encode(), f"a{HOSTILE}.bvh")
    missing = await get(server, "/v1/none/%1B%5D0;owned%07%E2%80%AE")
    for answer, status in ((rejected, 422), (missing, 404)):
        assert answer.status_code == status
        texts = [text for text in answer.json().values() if isinstance(text, str)]
        assert len(texts) > 3
        assert all(text == clean_text(text, 1_000) for text in texts)
    assert rejected.json()["filename"] == "a.bvh"


async def test_motions_are_listed_by_page_and_removed(tmp_path: Path) -> None:
    with run_server(tmp_path) as url:
        ids = [(await post(url, make_bvh_clip(0.4, seed))).json()["id"] for seed in range(3)]
        page = (await get(url, "/v1/motions?limit=2")).json()
        rest = (await get(url, f"/v1/motions?limit=2&cursor={page['next']}")).json()
        assert [m["id"] for m in page["items"] + rest["items"]] == ids[::-1]
        assert rest["next"] is None
        async with httpx2.AsyncClient(base_url=url) as http:
            assert (await http.delete(f"/v1/motions/{ids[0]}")).status_code == 204
            assert (await http.delete(f"/v1/motions/{ids[0]}")).status_code == 404
            assert (await http.get(f"/v1/motions/{ids[0]}")).status_code == 404
            assert (await http.get(f"/v1/motions/{ids[0]}/blocks/0/0")).status_code == 404


VALID_CLIP = make_bvh_clip(0.2)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        (b"", "empty"),
        (b"this is not a motion", ""),
        (VALID_CLIP.replace(b"ROOT", b"ROOT", 1)[:200], ""),
        (
            VALID_CLIP.replace(b"MOTION", VALID_CLIP.split(b"MOTION")[0].removeprefix(b"HIERARCHY\n") + b"MOTION", 1),
            "root",
        ),
        (VALID_CLIP[:-8] + b" nan\n", "nan"),
    ],
)
async def test_unreadable_file_is_rejected_and_not_stored(server: str, data: bytes, message: str) -> None:
    before = (await get(server, "/v1/motions?limit=200")).json()
    response = await post(server, data, "bad.bvh")
    assert response.status_code == 422
    assert response.headers["content-type"] == "application/problem+json"
    problem = response.json()
    assert problem["status"] == 422
    assert problem["title"]
    assert problem["hint"]
    assert message in (problem["title"] + problem["detail"]).lower()
    assert (await get(server, "/v1/motions?limit=200")).json() == before


async def test_oversized_upload_is_rejected_while_receiving(tmp_path: Path) -> None:
    with run_server(tmp_path, upload_bytes=10_000) as url:
        assert (await post(url, bytes(10_001))).status_code == 413

        sent = 0

        async def stream_body() -> AsyncIterator[bytes]:
            nonlocal sent
            for _ in range(5_000):
                sent += 4_000
                yield b"0 " * 2_000

        async with httpx2.AsyncClient(base_url=url, timeout=HANG_TIMEOUT_S) as http:
            try:
                response = await http.post("/v1/motions", params={"filename": "x.bvh"}, content=stream_body())
            except httpx2.TransportError:
                assert sent < 20_000_000  # the server closed the connection while the client was sending
            else:
                assert response.status_code == 413
                assert response.json()["limit"] == 10_000
        assert (await get(url, "/v1/motions")).json()["items"] == []


async def test_slow_job_is_rejected(tmp_path: Path) -> None:
    with run_server(tmp_path, upload_seconds=0.001) as url:
        response = await post(url, make_bvh_clip(3.0, 77))
    assert response.status_code == 422
    assert "long" in response.json()["title"]


async def test_concurrent_uploads_succeed_or_get_503(server: str) -> None:
    clips = [make_bvh_clip(0.3, 500 + seed % 4) for seed in range(8)]
    responses = await asyncio.gather(*(post(server, data) for data in clips))
    assert {response.status_code for response in responses} <= {200, 201, 503}
    assert len({response.json()["id"] for response in responses if response.status_code != 503}) <= 4


@pytest.mark.parametrize(
    "path", ["/v1/motions?limit=0", "/v1/motions?limit=x", "/v1/motions?cursor=zzz", "/v1/motions?limit=999999"]
)
async def test_invalid_query_gets_a_problem(server: str, path: str) -> None:
    response = await get(server, path)
    assert response.status_code == 422
    assert response.json()["field"] in ("limit", "cursor")


async def test_one_take_and_all_takes_exclude_each_other(server: str) -> None:
    async with httpx2.AsyncClient(base_url=server, timeout=HANG_TIMEOUT_S) as http:
        for query in ({"takes": "all", "take": "walk"}, {"takes": "some"}):
            response = await http.post("/v1/motions", params={"filename": "a.bvh", **query}, content=VALID_CLIP)
            assert response.status_code == 422


async def test_upload_requires_a_filename(server: str) -> None:
    async with httpx2.AsyncClient(base_url=server) as http:
        response = await http.post("/v1/motions", content=b"x")
    assert response.status_code == 422
    assert response.json()["field"] == "filename"
