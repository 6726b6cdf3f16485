from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from pathlib import Path

import httpx2
import pytest

from tests.servers import make_bvh_clip, run_server


async def post(url: str, data: bytes, filename: str = "clip.bvh") -> httpx2.Response:
    async with httpx2.AsyncClient(base_url=url, timeout=60) as http:
        return await http.post("/v1/motions", params={"filename": filename}, content=data)


async def get(url: str, path: str) -> httpx2.Response:
    async with httpx2.AsyncClient(base_url=url, timeout=60) as http:
        return await http.get(path)


async def test_an_upload_becomes_a_motion_and_the_same_bytes_the_same_one(server: str) -> None:
    data = make_bvh_clip(seed=41)
    first = await post(server, data, "My dance.bvh")
    assert first.status_code == 201
    motion = first.json()
    assert first.headers["location"] == f"/v1/motions/{motion['id']}"
    assert motion["name"] == "My dance"
    assert motion["duration"] == pytest.approx(3.4)
    assert (motion["fps"], motion["frames"], motion["blocks"]) == (30, 102, 4)
    assert len(motion["joints"]) == 18
    assert motion["fit"]["mean_mm"] < 1
    assert len(motion["rates"]) >= 3
    again = await post(server, data, "other name.bvh")
    assert (again.status_code, again.json()) == (200, motion)
    assert (await get(server, f"/v1/motions/{motion['id']}")).json() == motion


async def test_motions_are_listed_newest_first_page_by_page_and_removed(tmp_path: Path) -> None:
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
    ("data", "says"),
    [
        (b"", "empty"),
        (b"this is no motion", ""),
        (VALID_CLIP.replace(b"ROOT", b"ROOT", 1)[:200], ""),
        (
            VALID_CLIP.replace(b"MOTION", VALID_CLIP.split(b"MOTION")[0].removeprefix(b"HIERARCHY\n") + b"MOTION", 1),
            "root",
        ),
        (VALID_CLIP[:-8] + b" nan\n", "nan"),
    ],
)
async def test_what_cannot_be_read_is_refused_in_words_and_nothing_is_stored(
    server: str, data: bytes, says: str
) -> None:
    before = (await get(server, "/v1/motions?limit=200")).json()
    answer = await post(server, data, "bad.bvh")
    assert answer.status_code == 422
    assert answer.headers["content-type"] == "application/problem+json"
    problem = answer.json()
    assert problem["status"] == 422
    assert problem["title"]
    assert problem["hint"]
    assert says in (problem["title"] + problem["detail"]).lower()
    assert (await get(server, "/v1/motions?limit=200")).json() == before


async def test_too_large_is_refused_while_it_comes(tmp_path: Path) -> None:
    with run_server(tmp_path, upload_bytes=10_000) as url:
        assert (await post(url, bytes(10_001))).status_code == 413

        sent = 0

        async def long() -> AsyncIterator[bytes]:
            nonlocal sent
            for _ in range(5_000):
                sent += 4_000
                yield b"0 " * 2_000

        async with httpx2.AsyncClient(base_url=url, timeout=20) as http:
            try:
                answer = await http.post("/v1/motions", params={"filename": "x.bvh"}, content=long())
            except httpx2.TransportError:
                assert sent < 20_000_000  # cut off while sending, before the answer was read
            else:
                assert answer.status_code == 413
                assert answer.json()["limit"] == 10_000
        assert (await get(url, "/v1/motions")).json()["items"] == []


async def test_what_takes_too_long_is_ended(tmp_path: Path) -> None:
    with run_server(tmp_path, upload_seconds=0.001) as url:
        answer = await post(url, make_bvh_clip(3.0, 77))
    assert answer.status_code == 422
    assert "long" in answer.json()["title"]


async def test_many_uploads_at_once_all_end_well_or_are_told_to_wait(server: str) -> None:
    clips = [make_bvh_clip(0.3, 500 + seed % 4) for seed in range(8)]
    answers = await asyncio.gather(*(post(server, data) for data in clips))
    assert {answer.status_code for answer in answers} <= {200, 201, 503}
    assert len({answer.json()["id"] for answer in answers if answer.status_code != 503}) <= 4


@pytest.mark.parametrize(
    "path", ["/v1/motions?limit=0", "/v1/motions?limit=x", "/v1/motions?cursor=zzz", "/v1/motions?limit=999999"]
)
async def test_wrong_questions_get_problems(server: str, path: str) -> None:
    answer = await get(server, path)
    assert answer.status_code == 422
    assert answer.json()["field"] in ("limit", "cursor")


async def test_an_upload_needs_a_name(server: str) -> None:
    async with httpx2.AsyncClient(base_url=server) as http:
        answer = await http.post("/v1/motions", content=b"x")
    assert answer.status_code == 422
    assert answer.json()["field"] == "filename"
