from __future__ import annotations

import asyncio
import json
from pathlib import Path
from typing import Any

import httpx2
import pytest

from bunraku.codec.timing import Timing
from bunraku.ingest.edit import EditOperation, EditPlan, EditRequest, create_edit_job, describe_edit, plan_edit
from bunraku.ingest.job_queue import JobQueue, JobQueueTiming
from bunraku.ingest.worker_slots import WorkerSlots
from bunraku.runtime.context import ServiceContext, open_context
from bunraku.runtime.problem import ProblemError
from bunraku.runtime.settings import Settings
from bunraku.storage.record import Job
from tests.audio import make_tone, write_audio
from tests.servers import make_bvh_clip, run_server
from tests.time_limit import HANG_TIMEOUT_S

TIMING = Timing(30.0, 90, 30, 15)


def open_client(url: str) -> httpx2.AsyncClient:
    return httpx2.AsyncClient(base_url=url, timeout=HANG_TIMEOUT_S)


async def post_motion(http: httpx2.AsyncClient, seed: int, name: str = "dance") -> dict[str, Any]:
    response = await http.post("/v1/motions", params={"filename": f"{name}.bvh"}, content=make_bvh_clip(1.0, seed))
    assert response.status_code in (200, 201), response.text
    created: dict[str, Any] = response.json()
    return created


async def test_edit_creates_a_motion_once(server: str, tmp_path: Path) -> None:
    async with open_client(server) as http:
        motion = await post_motion(http, 71, "crane")
        sound = write_audio(tmp_path / "a.wav", make_tone(1.0, 48_000), 48_000).read_bytes()
        path = f"/v1/motions/{motion['id']}"
        sounding = (await http.post(f"{path}/audio", params={"filename": "a.wav"}, content=sound)).json()
        path = f"/v1/motions/{sounding['id']}"
        await http.patch(path, json={"tags": ["slow"]})
        request = {"start": 210_000, "end": 800_000, "mirror": True, "loop": True}
        response = await http.post(f"{path}/edits", json=request)
        assert response.status_code == 201, response.text
        edited = response.json()
        assert response.headers["location"] == f"/v1/motions/{edited['id']}"
        assert (edited["name"], edited["tags"], edited["made_from"]) == (
            "crane, cut, mirrored, loop",
            ["slow"],
            sounding["id"],
        )
        assert (edited["frames"], edited["tracks"]) == (18, ["motion", "audio"])
        assert edited["duration"] == pytest.approx(0.6)
        assert edited["audio"]["seconds"] == pytest.approx(0.6)
        assert edited["audio"]["filename"] == "a.wav"
        assert [level["max"] for level in edited["rates"]] == [level["max"] for level in motion["rates"]]
        assert edited["joints"]["l_hip"] == motion["joints"]["r_hip"]
        assert "ladders" not in edited
        repeated = await http.post(f"{path}/edits", json={**request, "start": 200_000})
        assert (repeated.status_code, repeated.json()) == (200, edited)
        named = (await http.post(f"{path}/edits", json={**request, "name": " Neu "})).json()
        assert (named["name"], named["id"] == edited["id"]) == ("Neu", False)
        assert (await http.get(path)).json()["frames"] == 30
        assert (await http.get(f"/v1/motions/{edited['id']}/blocks/4/0")).status_code == 200


@pytest.mark.parametrize(
    ("body", "field"),
    [
        ({}, "start"),
        ({"name": "x"}, "start"),
        ({"start": 0, "end": 1_000_000}, "start"),
        ({"start": 10_000, "end": 990_000}, "start"),
        ({"mirror": False}, "start"),
        ({"start": 500_000, "end": 500_000}, "end"),
        ({"start": 600_000, "end": 500_000}, "end"),
        ({"start": 1_000_000}, "start"),
        ({"start": 9_000_000_000_000_000}, "start"),
        ({"end": 1_000_001}, "end"),
        ({"end": 0}, "end"),
        ({"start": -1}, "start"),
        ({"start": 0.5}, "start"),
        ({"start": None}, "start"),
        ({"mirror": "yes"}, "mirror"),
        ({"loop": 1}, "loop"),
        ({"mirror": True, "name": " "}, "name"),
        ({"mirror": True, "name": "n" * 201}, "name"),
        ({"mirror": True, "reverse": True}, "reverse"),
    ],
)
async def test_invalid_edit_names_its_field(server: str, body: dict[str, Any], field: str) -> None:
    async with open_client(server) as http:
        motion = await post_motion(http, 72)
        response = await http.post(f"/v1/motions/{motion['id']}/edits", json=body)
        assert response.status_code == 422, response.text
        assert response.json()["field"] == field


async def test_edit_of_an_unknown_motion_gets_404(server: str) -> None:
    async with open_client(server) as http:
        response = await http.post(f"/v1/motions/{'x' * 20}/edits", json={"mirror": True})
        assert (response.status_code, response.json()["title"]) == (404, "No such motion")


async def test_edit_left_by_a_failed_replica_is_finished_by_another(tmp_path: Path) -> None:
    with run_server(tmp_path) as url:
        async with open_client(url) as http:
            motion = (await post_motion(http, 73))["id"]
    request = EditRequest(mirror=True)
    job = create_edit_job(motion, request, "")
    source = tmp_path / "request"
    await asyncio.to_thread(source.write_text, request.model_dump_json())
    async with open_context(Settings(data=tmp_path)) as context:
        await context.motion_store.put_source(job.id, source)
        # released by a replica that has stopped
        await context.catalogue.add_job(Job(job.id, 5, job.details), "gone", 0)
        slots = WorkerSlots()
        queue = JobQueue(context, slots, {"edit": EditOperation(context, slots).run_job}, JobQueueTiming(0.02, 400_000))
        running = asyncio.create_task(queue.run())
        try:
            async with asyncio.timeout(HANG_TIMEOUT_S):
                while await context.catalogue.find_jobs([job.id]):  # noqa: ASYNC110
                    await asyncio.sleep(0.02)
        finally:
            running.cancel()
            await asyncio.wait((running,))
        assert await find_edited(context, motion) == ["dance, mirrored"]


async def find_edited(context: ServiceContext, motion: str) -> list[str]:
    entries, _ = await context.catalogue.list_motions(10)
    return [entry.description["name"] for entry in entries if entry.description.get("made_from") == motion]


@pytest.mark.parametrize(
    ("request_fields", "plan"),
    [
        ({"start": 0, "end": 1_000_000}, EditPlan(0, 30, False, False, True)),
        ({"start": 16_667}, EditPlan(1, 90, False, False, True)),
        ({"start": 16_000, "loop": True}, EditPlan(0, 90, False, True, False)),
        ({"end": 3_000_000, "mirror": True}, EditPlan(0, 90, True, False, False)),
        ({"start": 2_980_000}, EditPlan(89, 90, False, False, True)),
    ],
)
def test_times_are_rounded_to_frames(request_fields: dict[str, Any], plan: EditPlan) -> None:
    assert plan_edit(TIMING, EditRequest(**request_fields)) == plan


def test_part_shorter_than_a_frame_is_rejected() -> None:
    with pytest.raises(ProblemError, match="at least one frame"):
        plan_edit(TIMING, EditRequest(start=100_000, end=101_000))


def test_description_follows_the_edit() -> None:
    base = {"name": "n" * 200, "joints": {"l_hip": "L", "vl5": "S"}, "audio": {"filename": "a", "seconds": 3.0}}
    rates = [{"kbps": 1.0, "mean": 2.0, "max": 3.0}]
    result = {"ladders": [rates, rates], "frames": 3}
    described = describe_edit(base, result, EditPlan(0, 3, True, False, True), None)
    assert described["name"] == f"{'n' * 185}, cut, mirrored"
    assert described["joints"] == {"r_hip": "L", "vl5": "S"}
    assert described["rates"] == [{"kbps": 2.0, "mean": 2.0, "max": 3.0}]
    assert "audio" not in described
    assert json.loads(json.dumps(described)) == described
