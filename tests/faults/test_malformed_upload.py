"""Hostile uploads: each is rejected with a reason within a short time and leaves nothing behind."""

from __future__ import annotations

import tempfile
from collections.abc import AsyncIterator, Callable
from pathlib import Path

import httpx2
import pytest

from tests.servers import make_bvh_clip
from tests.time_limit import HANG_TIMEOUT_S

VALID_BVH = make_bvh_clip(0.3)
HEAD, FRAMES = VALID_BVH.split(b"MOTION", 1)


def nested_joints(count: int) -> bytes:
    deep = b"".join(b"JOINT j%d\n{\nOFFSET 0 1 0\nCHANNELS 0\n" % i for i in range(count))
    return b"HIERARCHY\nROOT r\n{\nOFFSET 0 0 0\nCHANNELS 0\n" + deep + b"}\n" * (count + 1) + b"MOTION\nFrames: 0\n"


MALFORMED_FILES: dict[str, Callable[[], bytes]] = {
    "nothing": lambda: b"",
    "zeros": lambda: bytes(1_000_000),
    "a million joints": lambda: nested_joints(1_000_000),
    "a million frames": lambda: (
        b"HIERARCHY\nROOT r\n{\nOFFSET 0 0 0\nCHANNELS 3 Xposition Yposition Zposition\n"
        b"End Site\n{\nOFFSET 0 1 0\n}\n}\nMOTION\nFrames: 1000000\nFrame Time: 0.01\n" + b"0 1 0\n" * 1_000_000
    ),
    "a line of 60 MB": lambda: HEAD + b"MOTION\nFrames: 1\nFrame Time: 0.03\n" + b"0" * 60_000_000,
    "numbers without end": lambda: HEAD + b"MOTION\nFrames: 2\nFrame Time: 0.03\n" + b"1e999 " * 1_000_000,
    "not a number": lambda: VALID_BVH.replace(b"MOTION", b"MOTION\n", 1)[:-6] + b"NaN\n",
    "two roots": lambda: HEAD + HEAD.removeprefix(b"HIERARCHY\n") + b"MOTION" + FRAMES,
    "open braces": lambda: HEAD.replace(b"}", b"") + b"MOTION" + FRAMES,
    "a joint within itself": lambda: HEAD.replace(b"JOINT l_hip", b"JOINT humanoid_root", 1) + b"MOTION" + FRAMES[:40],
    "another file": lambda: b"\x89PNG\r\n\x1a\n" + bytes(1000),
}


def leftover_sources() -> list[Path]:
    return list(Path(tempfile.gettempdir()).glob("bunraku-upload-*/source"))


@pytest.mark.parametrize("name", MALFORMED_FILES)
async def test_malformed_upload_is_rejected_with_hint_and_leaves_nothing(server: str, name: str) -> None:
    async with httpx2.AsyncClient(base_url=server, timeout=HANG_TIMEOUT_S) as http:
        before = (await http.get("/v1/motions?limit=200")).json()
        response = await http.post("/v1/motions", params={"filename": f"{name}.bvh"}, content=MALFORMED_FILES[name]())
        assert response.status_code in (413, 422), response.text
        problem = response.json()
        assert problem["title"]
        assert problem["detail"]
        assert problem["hint"]
        assert (await http.get("/v1/motions?limit=200")).json() == before
        assert (await http.get("/v1/health")).status_code == 200
    assert not leftover_sources()


async def test_line_of_a_gigabyte_is_rejected_early(server: str) -> None:
    sent_bytes = 0

    async def endless_line() -> AsyncIterator[bytes]:
        nonlocal sent_bytes
        yield HEAD + b"MOTION\nFrames: 1\nFrame Time: 0.03\n"
        for _ in range(1_000):
            sent_bytes += 1 << 20
            yield b"0" * (1 << 20)

    async with httpx2.AsyncClient(base_url=server, timeout=HANG_TIMEOUT_S) as http:
        try:
            assert (
                await http.post("/v1/motions", params={"filename": "x.bvh"}, content=endless_line())
            ).status_code == 413
        except httpx2.TransportError:
            assert sent_bytes < 500 << 20
        assert (await http.get("/v1/health")).status_code == 200


async def test_interrupted_upload_leaves_nothing(server: str) -> None:
    class ClientGone(Exception):
        pass

    async def partial_upload() -> AsyncIterator[bytes]:
        yield VALID_BVH[:1000]
        raise ClientGone

    async with httpx2.AsyncClient(base_url=server, timeout=HANG_TIMEOUT_S) as http:
        before = (await http.get("/v1/motions?limit=200")).json()
        with pytest.raises(ClientGone):
            await http.post("/v1/motions", params={"filename": "x.bvh"}, content=partial_upload())
        assert (await http.get("/v1/motions?limit=200")).json() == before
