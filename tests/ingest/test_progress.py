from __future__ import annotations

import asyncio
from pathlib import Path
from typing import Any

import httpx2
import pytest

from bunraku.ingest.progress import UploadProgress
from bunraku.ingest.upload import MAX_UPLOADS_PER_HOLDER
from tests.servers import make_bvh_clip, run_server
from tests.time_limit import HANG_TIMEOUT_S


async def poll_progress(
    http: httpx2.AsyncClient, upload: str, until: str | None, posting: asyncio.Task[Any]
) -> list[Any]:
    """Return the reported progress of an upload, up to a stage or to the end of `posting`."""
    reports: list[Any] = []
    while not posting.done() and (until is None or not reports or reports[-1]["stage"] != until):
        response = await http.get(f"/v1/uploads/{upload}")
        if response.status_code == 200:
            assert response.headers["cache-control"] == "no-store"
            reports.append(response.json())
        else:
            assert response.status_code == 404
    return reports


def post(http: httpx2.AsyncClient, upload: str, data: bytes) -> asyncio.Task[httpx2.Response]:
    query = {"filename": "clip.bvh", "upload": upload}
    return asyncio.create_task(http.post("/v1/motions", params=query, content=data))


def test_stage_starts_with_share_zero() -> None:
    progress = UploadProgress()
    assert (progress.stage, progress.share) == ("receiving", 0.0)
    progress.advance_to("encoding", 0.5)
    progress.advance_to("waiting")
    assert (progress.stage, progress.share) == ("waiting", 0.0)
    assert (progress.take, progress.takes) == (1, 1)
    progress.begin_take(2, 3)
    assert (progress.take, progress.takes, progress.stage) == (2, 3, "waiting")


async def test_shares_rise_while_an_upload_is_encoded(server: str) -> None:
    async with httpx2.AsyncClient(base_url=server, timeout=HANG_TIMEOUT_S) as http:
        posting = post(http, "upload-one", make_bvh_clip(12.0, 900))
        reports = await poll_progress(http, "upload-one", None, posting)
        assert (await posting).status_code == 201
        assert (await http.get("/v1/uploads/upload-one")).status_code == 404
        repeated = post(http, "upload-one", make_bvh_clip(12.0, 900))
        assert (await repeated).status_code == 200
    stages = [report["stage"] for report in reports]
    order = ["receiving", "waiting", "reading", "encoding"]
    assert stages == sorted(stages, key=order.index)
    shares = [report["share"] for report in reports if report["stage"] == "encoding"]
    assert shares == sorted(shares)
    assert len(set(shares)) > 5
    assert 0 <= shares[0] < 0.5 < shares[-1] <= 1


async def test_disconnect_cancels_the_upload(tmp_path: Path) -> None:
    with run_server(tmp_path) as url:
        async with httpx2.AsyncClient(base_url=url, timeout=HANG_TIMEOUT_S) as http:
            posting = post(http, "upload-two", make_bvh_clip(60.0, 901))
            await poll_progress(http, "upload-two", "encoding", posting)
            other = await post(http, "upload-two", make_bvh_clip(0.3))
            assert other.status_code == 409
            assert other.json()["field"] == "upload"
            posting.cancel()
            while (await http.get("/v1/uploads/upload-two")).status_code == 200:
                pass
            assert (await http.get("/v1/motions")).json()["items"] == []
            # all slots are free again
            responses = [
                await post(http, f"upload-{number:02}", make_bvh_clip(0.2, 902))
                for number in range(MAX_UPLOADS_PER_HOLDER + 1)
            ]
            assert {response.status_code for response in responses} == {200, 201}


@pytest.mark.parametrize("name", ["short", "x" * 65, "with%20blank", "né-à-mesure"])
async def test_invalid_upload_name_is_rejected(server: str, name: str) -> None:
    async with httpx2.AsyncClient(base_url=server, timeout=HANG_TIMEOUT_S) as http:
        requested = await http.get(f"/v1/uploads/{name}")
        assert requested.status_code == 422
        assert requested.json()["field"] == "upload"
        posted = await post(http, name, make_bvh_clip(0.2))
        assert posted.status_code == 422
