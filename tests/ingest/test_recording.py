from __future__ import annotations

import asyncio
import multiprocessing
import secrets
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import msgpack
import pytest

from bunraku.ingest.app import create_app
from bunraku.ingest.motion import MotionOperation
from bunraku.ingest.recording import RecordingOperation, parse_recording_request
from bunraku.ingest.source_file import SourceFile
from bunraku.ingest.worker_slots import WorkerSlots
from bunraku.messaging.bus import NoResponse
from bunraku.messaging.recording_request import MAX_RECORDING_S, RECORDING_SUBJECT, pack_camera
from bunraku.playout import timeline
from bunraku.playout.session_log import SessionLog
from bunraku.runtime.context import ServiceContext, open_context
from bunraku.runtime.problem import ProblemError
from bunraku.runtime.settings import Settings
from tests.servers import make_bvh_clip

START_CLOCK_US = 1_700_000_000_000_000
SECOND_US = 1_000_000


@pytest.fixture
async def context(tmp_path: Path) -> AsyncIterator[ServiceContext]:
    async with open_context(Settings(data=tmp_path / "data")) as opened:
        app = create_app(opened)
        async with app.router.lifespan_context(app):
            yield opened


@pytest.fixture
async def motion_id(context: ServiceContext, tmp_path: Path) -> str:
    """Store a motion of 2 s and the log `log` of a session that played it."""
    source = tmp_path / "source"
    source.write_bytes(make_bvh_clip(2.0, 51))
    entry, _ = await MotionOperation(context, WorkerSlots()).ingest_file("dance", SourceFile(source, "Swan.bvh"))
    log = SessionLog()
    log.add_timeline(timeline.start(entry.id, 2 * SECOND_US, START_CLOCK_US))
    await context.motion_store.put_log("log", log.pack())
    return entry.id


def make_request(**changes: Any) -> bytes:
    values = {
        "log": "log",
        "name": None,
        "begin": START_CLOCK_US,
        "end": START_CLOCK_US + SECOND_US,
        "camera": b"",
    } | changes
    packed: bytes = msgpack.packb(values)
    return packed


async def send_request(context: ServiceContext, message: bytes) -> dict[str, Any]:
    name = f"order-{secrets.token_hex(4)}"
    await context.motion_store.put_log(name, message)
    response: dict[str, Any] = msgpack.unpackb(
        await context.bus.request(RECORDING_SUBJECT, name.encode(), timeout_s=60)
    )
    return response


async def test_session_is_recorded_as_a_motion(context: ServiceContext, motion_id: str) -> None:
    camera = pack_camera([[START_CLOCK_US, 0.0, 1.2, 4.0, 0.0, 1.0, 0.0, 0.5]])
    motion = (await send_request(context, make_request(camera=camera)))["motion"]
    entry = await context.catalogue.get_motion(motion["id"])
    stored = await context.motion_store.get(motion["id"])
    known = await context.catalogue.get_motion(motion_id)
    assert entry is not None
    assert stored is not None
    assert known is not None
    assert motion["name"] == "Swan, kept"
    assert motion["source"] == f"kept from a session of Swan ({motion_id})"
    assert (motion["duration"], motion["frames"], motion["fps"]) == (1.0, 60, 60)
    assert motion["tracks"] == ["motion", "camera"]
    assert motion["joints"] == known.description["joints"]
    assert [len(track[0]) for track in stored.packets] == [1, 1]
    named = (await send_request(context, make_request(name=" My \x1b[31mdu\u202eet\n ")))["motion"]
    assert named["name"] == "My duet"
    assert named["id"] != motion["id"]
    page, _ = await context.catalogue.list_motions(9)
    assert [e.id for e in page] == [named["id"], motion["id"], motion_id]


@pytest.mark.parametrize(
    ("changes", "status", "field"),
    [
        ({"log": "another"}, 404, "log"),
        ({"log": "../motions/dance"}, 404, "log"),
        ({"end": START_CLOCK_US}, 422, "seconds"),
        ({"begin": START_CLOCK_US - 2 * SECOND_US, "end": START_CLOCK_US - SECOND_US}, 422, "seconds"),
        ({"camera": pack_camera([[START_CLOCK_US, 0, 1, 4, 0, 1, 0, 9.0]])}, 422, "camera"),
    ],
)
async def test_impossible_recording_is_a_problem_and_not_stored(
    context: ServiceContext, motion_id: str, changes: dict[str, Any], status: int, field: str
) -> None:
    problem = (await send_request(context, make_request(**changes)))["problem"]
    assert (problem["status"], problem["field"]) == (status, field)
    assert problem["title"]
    assert problem["detail"]
    assert [e.id for e in (await context.catalogue.list_motions(9))[0]] == [motion_id]


async def test_unreadable_log_is_a_problem(context: ServiceContext, motion_id: str) -> None:
    await context.motion_store.put_log("log", b"\xc1")
    problem = (await send_request(context, make_request()))["problem"]
    assert problem["status"] == 422
    assert problem["title"] == "Unreadable log"
    assert [e.id for e in (await context.catalogue.list_motions(9))[0]] == [motion_id]


async def test_removed_motion_is_a_problem(context: ServiceContext, motion_id: str) -> None:
    await context.motion_store.remove(motion_id)
    assert (await send_request(context, make_request()))["problem"]["title"] == "Cannot be replayed"


@pytest.mark.usefixtures("motion_id")
async def test_recording_beyond_the_limit_gets_503(
    context: ServiceContext,
) -> None:
    operation = RecordingOperation(context, WorkerSlots(), max_active=1)
    await context.motion_store.put_log("order", make_request())
    responses = await asyncio.gather(*(operation.handle_message(b"order") for _ in range(2)))
    rejected, recorded = sorted(map(msgpack.unpackb, responses), key=lambda response: "motion" in response)
    assert "motion" in recorded
    assert rejected["problem"]["status"] == 503
    assert "motion" in msgpack.unpackb(await operation.handle_message(b"order"))


@pytest.mark.usefixtures("motion_id")
async def test_lease_is_held_while_a_session_is_recorded(context: ServiceContext) -> None:
    changes: list[str] = []
    context.key_values.watch().on_change(lambda key, _: changes.append(key))
    assert "motion" in await send_request(context, make_request())
    # taken and released
    assert changes.count("recordings.log") == 2
    assert context.key_values.watch().entries == {}


async def test_slow_recording_is_cancelled(context: ServiceContext, motion_id: str) -> None:
    operation = RecordingOperation(context, WorkerSlots(), timeout_s=0.001)
    await context.motion_store.put_log("order", make_request())
    problem = msgpack.unpackb(await operation.handle_message(b"order"))["problem"]
    assert (problem["status"], problem["title"]) == (503, "Busy")
    assert [e.id for e in (await context.catalogue.list_motions(9))[0]] == [motion_id]


async def test_abandoned_request_leaves_no_process(context: ServiceContext, motion_id: str) -> None:
    await context.motion_store.put_log("order", make_request())
    with pytest.raises(NoResponse):
        await context.bus.request(RECORDING_SUBJECT, b"order", timeout_s=0.1)
    assert not multiprocessing.active_children()
    assert [e.id for e in (await context.catalogue.list_motions(9))[0]] == [motion_id]
    assert "motion" in await send_request(context, make_request())


@pytest.mark.parametrize("name", [b"none", b"../log", b"\xff", b""])
async def test_missing_recording_request_is_a_problem(context: ServiceContext, name: bytes) -> None:
    problem = msgpack.unpackb(await context.bus.request(RECORDING_SUBJECT, name))["problem"]
    assert (problem["status"], problem["title"]) == (404, "No such order")


async def test_stopped_service_does_not_respond(tmp_path: Path) -> None:
    async with open_context(Settings(data=tmp_path)) as opened:
        app = create_app(opened)
        async with app.router.lifespan_context(app):
            pass
        with pytest.raises(NoResponse):
            await opened.bus.request(RECORDING_SUBJECT, make_request())


VALID_REQUEST: dict[str, Any] = {
    "log": "l",
    "name": "Mine",
    "begin": 1_000_000,
    "end": 3_000_000,
    "camera": pack_camera([[1, *range(7)]]),
}


def test_recording_request_is_parsed() -> None:
    request = parse_recording_request(msgpack.packb(VALID_REQUEST | {"later": "more"}))
    assert (request.log, request.name, request.begin, request.end) == ("l", "Mine", 1_000_000, 3_000_000)
    assert request.camera_keyframes.tolist() == [[1, 0, 1, 2, 3, 4, 5, 6]]
    assert request.frame_count == 120
    minimal = parse_recording_request(msgpack.packb({key: VALID_REQUEST[key] for key in ("log", "begin", "end")}))
    assert (minimal.name, minimal.camera) == (None, b"")


@pytest.mark.parametrize(
    ("changes", "field"),
    [
        ({"log": None}, "log"),
        ({"begin": -1}, "begin"),
        ({"end": "late"}, "end"),
        ({"end": 1_000_000}, "seconds"),
        ({"end": 999}, "seconds"),
        ({"end": 2_000_000 + MAX_RECORDING_S * 1_000_000}, "seconds"),
        ({"name": "n" * 201}, "name"),
        ({"camera": bytes(72)}, "camera"),
        ({"camera": pack_camera([[1, *range(7)], [2, *range(6), float("nan")]])}, "camera"),
        ({"camera": pack_camera([[2, *range(7)], [2, *range(7)]])}, "camera"),
    ],
)
def test_invalid_request_names_its_field(changes: dict[str, Any], field: str) -> None:
    with pytest.raises(ProblemError) as raised:
        parse_recording_request(msgpack.packb(VALID_REQUEST | changes))
    assert raised.value.status == 422
    assert raised.value.extra["field"] == field


@pytest.mark.parametrize("data", [b"", b"\xc1", b"\x01", b"\x81\x01", msgpack.packb([1])])
def test_malformed_request_is_rejected(data: bytes) -> None:
    with pytest.raises(ProblemError):
        parse_recording_request(data)
