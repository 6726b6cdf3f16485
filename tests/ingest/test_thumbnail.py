from __future__ import annotations

import asyncio
import base64
import dataclasses
import hashlib
import re
from pathlib import Path
from typing import Any

import httpx2
import pytest
from starlette.requests import Request

from bunraku.codec.container import StoredMotion
from bunraku.ingest import thumbnail
from bunraku.ingest.jobs.thumbnail import draw_thumbnail
from bunraku.ingest.thumbnail import Thumbnails, middle_blocks
from bunraku.runtime.context import ServiceContext, open_context
from bunraku.runtime.problem import ProblemError
from bunraku.runtime.settings import Settings
from bunraku.runtime.worker_process import run_in_worker
from bunraku.storage.record import CatalogueEntry
from tests.ingest.jobs.motions import MOTIONS
from tests.servers import make_bvh_clip
from tests.time_limit import HANG_TIMEOUT_S


def make_request() -> Request:
    return Request({"type": "http", "client": ("127.0.0.1", 1), "headers": []})


async def test_thumbnail_is_an_immutable_harmless_picture(server: str) -> None:
    async with httpx2.AsyncClient(base_url=server, timeout=HANG_TIMEOUT_S) as http:
        motion = (await http.post("/v1/motions?filename=a.bvh", content=make_bvh_clip(1.0, 51))).json()["id"]
        path = f"/v1/motions/{motion}/thumbnail"
        picture = await http.get(path)
        assert picture.status_code == 200, picture.text
        assert picture.headers["content-type"] == "image/svg+xml"
        assert picture.headers["cache-control"] == "public, max-age=31536000, immutable"
        assert picture.headers["x-content-type-options"] == "nosniff"
        assert 1_500 < len(picture.content) < 4_096
        policy = picture.headers["content-security-policy"]
        assert policy.startswith("default-src 'none'; frame-ancestors 'none'; style-src 'sha256-")
        # the policy permits the style sheet of the picture, and no other
        (style,) = re.findall("<style>(.*?)</style>", picture.text)
        assert base64.b64encode(hashlib.sha256(style.encode()).digest()).decode() in policy
        assert "script" not in picture.text
        etag = picture.headers["etag"]
        unchanged = await http.get(path, headers={"If-None-Match": f"W/{etag}"})
        assert (unchanged.status_code, unchanged.content, unchanged.headers["etag"]) == (304, b"", etag)
        # a new name changes nothing
        await http.patch(f"/v1/motions/{motion}", json={"name": "<script>"})
        again = await http.get(path)
        assert (again.content, again.headers["etag"]) == (picture.content, etag)
        both = (await http.post(f"/v1/motions/{motion}/performers", json={"motions": [motion]})).json()["id"]
        assert (await http.get(f"/v1/motions/{both}/thumbnail")).text.count("<ellipse") == 2
        await http.delete(f"/v1/motions/{motion}")
        assert (await http.get(path)).status_code == 404
        assert (await http.get(path, headers={"If-None-Match": etag})).status_code == 404


@pytest.mark.parametrize("name", ["one", "both", "longer"])
def test_all_performers_are_drawn_at_the_middle(name: str) -> None:
    stored = MOTIONS[name]
    blocks = middle_blocks(stored)
    assert len(blocks) == len(stored.performers)
    for performer, (bare, _, within) in zip(stored.performers, blocks, strict=True):
        assert bare.packets == []
        assert 0 <= within < performer.track.block_frames
    assert draw_thumbnail(blocks).count(b"<ellipse") == len(blocks)


async def open_thumbnails(context: ServiceContext, stored: StoredMotion) -> Thumbnails:
    await context.catalogue.add_motion(CatalogueEntry(stored.id, 5, {}))
    context.motion_store._loaded[stored.id] = stored
    return Thumbnails(context)


async def test_picture_is_drawn_once_for_concurrent_requests(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    drawn: list[int] = []

    async def count_run(*arguments: Any, **options: Any) -> Any:
        drawn.append(1)
        return await run_in_worker(*arguments, **options)

    monkeypatch.setattr(thumbnail, "run_in_worker", count_run)
    async with open_context(Settings(data=tmp_path)) as context:
        thumbnails = await open_thumbnails(context, MOTIONS["one"])
        pictures = await asyncio.gather(*(thumbnails.get("one", make_request()) for _ in range(8)))
        assert len(set(pictures)) == len(drawn) == 1


async def test_wanted_pictures_are_drawn_together(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    batches: list[int] = []

    async def count_run(function: Any, arguments: Any, *options: Any) -> Any:
        batches.append(len(arguments[0]))
        return await run_in_worker(function, arguments, *options)

    monkeypatch.setattr(thumbnail, "run_in_worker", count_run)
    async with open_context(Settings(data=tmp_path)) as context:
        for stored in MOTIONS.values():
            thumbnails = await open_thumbnails(context, stored)
        # one that is not there does not keep the others waiting
        names = [*MOTIONS, "lost"]
        await context.catalogue.add_motion(CatalogueEntry("lost", 5, {}))
        pictures = await asyncio.gather(
            *(thumbnails.get(name, make_request()) for name in names), return_exceptions=True
        )
        assert [isinstance(picture, bytes) for picture in pictures] == [True] * len(MOTIONS) + [False]
        assert pictures[0] != pictures[1]
        # the first begins at once, the rest waits for it
        assert batches == [1, len(MOTIONS) - 1]
        # the same as when it is drawn alone
        alone = Thumbnails(context)
        assert await alone.get("one", make_request()) == pictures[0]


async def test_damaged_motion_has_no_picture_but_others_have(tmp_path: Path) -> None:
    async with open_context(Settings(data=tmp_path)) as context:
        thumbnails = await open_thumbnails(context, MOTIONS["one"])
        two = MOTIONS["two"]
        (performer,) = two.performers
        damaged = [[packet[:3] + b"\xff" * 400 for packet in level] for level in performer.packets]
        broken = dataclasses.replace(two, id="broken", performers=(dataclasses.replace(performer, packets=damaged),))
        await open_thumbnails(context, broken)
        answers = await asyncio.gather(
            *(thumbnails.get(name, make_request()) for name in ("broken", "one")), return_exceptions=True
        )
        assert isinstance(answers[1], bytes)
        if isinstance(answers[0], ProblemError):
            assert answers[0].status == 422
        else:
            # random bytes may decode to some pose
            assert isinstance(answers[0], bytes)


async def test_oldest_picture_leaves_the_full_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(thumbnail, "MAX_CACHED_THUMBNAILS", 1)
    async with open_context(Settings(data=tmp_path)) as context:
        thumbnails = await open_thumbnails(context, MOTIONS["one"])
        await open_thumbnails(context, MOTIONS["two"])
        first = await thumbnails.get("one", make_request())
        await thumbnails.get("two", make_request())
        assert list(thumbnails._cached) == ["two"]
        assert await thumbnails.get("one", make_request()) == first


async def test_picture_waits_for_the_kernels(tmp_path: Path) -> None:
    async with open_context(Settings(data=tmp_path)) as context:
        context.kernels_compiled.clear()
        thumbnails = await open_thumbnails(context, MOTIONS["one"])
        with pytest.raises(ProblemError, match="preparing") as raised:
            await thumbnails.get("one", make_request())
        assert raised.value.status == 503


async def test_too_many_pictures_of_one_client_get_503(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(thumbnail, "MAX_DRAWINGS_PER_HOLDER", 1)
    async with open_context(Settings(data=tmp_path)) as context:
        thumbnails = await open_thumbnails(context, MOTIONS["one"])
        await open_thumbnails(context, MOTIONS["two"])
        answers = await asyncio.gather(
            *(thumbnails.get(name, make_request()) for name in ("one", "two")), return_exceptions=True
        )
        problem = answers[1]
        assert isinstance(problem, ProblemError)
        assert problem.status == 503


async def test_missing_object_gets_404(tmp_path: Path) -> None:
    async with open_context(Settings(data=tmp_path)) as context:
        await context.catalogue.add_motion(CatalogueEntry("lost", 5, {}))
        with pytest.raises(ProblemError) as raised:
            await Thumbnails(context).get("lost", make_request())
        assert raised.value.status == 404
