from __future__ import annotations

import asyncio
import multiprocessing
import secrets
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import msgpack
import pytest

from bunraku.ingest import recording
from bunraku.ingest.app import create_app
from bunraku.ingest.motion import UploadOperation
from bunraku.ingest.recording import RECORDING_SUBJECT, parse_recording_request
from bunraku.marionette.input_log import InputLog
from bunraku.messaging.bus import NoResponse
from bunraku.messaging.recording_request import MAX_RECORDING_S
from bunraku.playout import timeline
from bunraku.runtime.context import ServiceContext, open_context
from bunraku.runtime.problem import ProblemError
from bunraku.runtime.settings import Settings
from tests.servers import make_bvh_clip

START_CLOCK_US = 1_700_000_000_000_000
SECOND_US = 1_000_000


@pytest.fixture
async def backing(tmp_path: Path) -> AsyncIterator[ServiceContext]:
    async with open_context(Settings(data=tmp_path / "data")) as opened:
        app = create_app(opened)
        async with app.router.lifespan_context(app):
            yield opened


@pytest.fixture
async def dance(backing: ServiceContext, tmp_path: Path) -> str:
    """A dance of 2 s in the library, with a log \"log\" of a session that played it."""
    source = tmp_path / "source"
    source.write_bytes(make_bvh_clip(2.0, 51))
    entry, _ = await UploadOperation(backing).ingest_file("dance", source, "Swan.bvh")
    log = InputLog()
    log.add_timeline(timeline.start(entry.id, 2 * SECOND_US, START_CLOCK_US))
    await backing.motion_store.put_log("log", log.pack())
    return entry.id


def make_request(**change: Any) -> bytes:
    values = {
        "log": "log",
        "name": None,
        "begin": START_CLOCK_US,
        "end": START_CLOCK_US + SECOND_US,
        "camera": [],
    } | change
    packed: bytes = msgpack.packb(values)
    return packed


async def send_request(backing: ServiceContext, message: bytes) -> dict[str, Any]:
    name = f"order-{secrets.token_hex(4)}"
    await backing.motion_store.put_log(name, message)
    said: dict[str, Any] = msgpack.unpackb(await backing.bus.request(RECORDING_SUBJECT, name.encode(), timeout_s=60))
    return said


async def test_a_session_becomes_a_motion_of_the_library(backing: ServiceContext, dance: str) -> None:
    camera = [[float(START_CLOCK_US), 0.0, 1.2, 4.0, 0.0, 1.0, 0.0, 0.5]]
    motion = (await send_request(backing, make_request(camera=camera)))["motion"]
    entry = await backing.catalogue.get_motion(motion["id"])
    stored = await backing.motion_store.get(motion["id"])
    known = await backing.catalogue.get_motion(dance)
    assert entry is not None
    assert stored is not None
    assert known is not None
    assert motion["name"] == "Swan, kept"
    assert motion["source"] == f"kept from a session of Swan ({dance})"
    assert (motion["duration"], motion["frames"], motion["fps"]) == (1.0, 60, 60)
    assert motion["tracks"] == ["motion", "camera"]
    assert motion["joints"] == known.description["joints"]
    assert [len(track[0]) for track in stored.packets] == [2, 2]
    named = (await send_request(backing, make_request(name=" My duet ")))["motion"]
    assert named["name"] == "My duet"
    assert named["id"] != motion["id"]
    page, _ = await backing.catalogue.list_motions(9)
    assert [e.id for e in page] == [named["id"], motion["id"], dance]


@pytest.mark.parametrize(
    ("change", "status", "field"),
    [
        ({"log": "another"}, 404, "log"),
        ({"log": "../motions/dance"}, 404, "log"),
        ({"end": START_CLOCK_US}, 422, "seconds"),
        ({"begin": START_CLOCK_US - 2 * SECOND_US, "end": START_CLOCK_US - SECOND_US}, 422, "seconds"),
        ({"camera": [[float(START_CLOCK_US), 0, 1, 4, 0, 1, 0, 9.0]]}, 422, "camera"),
    ],
)
async def test_what_cannot_be_kept_is_a_problem_and_nothing_is_stored(
    backing: ServiceContext, dance: str, change: dict[str, Any], status: int, field: str
) -> None:
    problem = (await send_request(backing, make_request(**change)))["problem"]
    assert (problem["status"], problem["field"]) == (status, field)
    assert problem["title"]
    assert problem["detail"]
    assert [e.id for e in (await backing.catalogue.list_motions(9))[0]] == [dance]


async def test_a_log_that_cannot_be_read_is_a_problem(backing: ServiceContext, dance: str) -> None:
    await backing.motion_store.put_log("log", b"\xc1")
    problem = (await send_request(backing, make_request()))["problem"]
    assert problem["status"] == 422
    assert problem["title"] == "Unreadable log"
    assert [e.id for e in (await backing.catalogue.list_motions(9))[0]] == [dance]


async def test_a_dance_that_was_removed_cannot_be_kept(backing: ServiceContext, dance: str) -> None:
    await backing.motion_store.remove(dance)
    assert (await send_request(backing, make_request()))["problem"]["title"] == "Cannot be replayed"


@pytest.mark.usefixtures("dance")
async def test_more_than_may_wait_are_told_to_come_again(
    backing: ServiceContext, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recording, "MAX_ACTIVE_RECORDINGS", 1)
    one, other = await asyncio.gather(send_request(backing, make_request()), send_request(backing, make_request()))
    kept, told = (one, other) if "motion" in one else (other, one)
    assert "motion" in kept
    assert told["problem"]["status"] == 503
    assert "motion" in await send_request(backing, make_request())


async def test_one_that_takes_too_long_is_ended(
    backing: ServiceContext, dance: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(recording, "RECORDING_TIMEOUT_S", 0.001)
    problem = (await send_request(backing, make_request()))["problem"]
    assert (problem["status"], problem["title"]) == (503, "Busy")
    assert [e.id for e in (await backing.catalogue.list_motions(9))[0]] == [dance]


async def test_one_who_no_longer_waits_leaves_nothing_behind(backing: ServiceContext, dance: str) -> None:
    await backing.motion_store.put_log("order", make_request())
    with pytest.raises(NoResponse):
        await backing.bus.request(RECORDING_SUBJECT, b"order", timeout_s=0.1)
    assert not multiprocessing.active_children()
    assert [e.id for e in (await backing.catalogue.list_motions(9))[0]] == [dance]
    assert "motion" in await send_request(backing, make_request())


@pytest.mark.parametrize("name", [b"none", b"../log", b"\xff", b""])
async def test_an_order_that_is_not_there_is_said_so(backing: ServiceContext, name: bytes) -> None:
    problem = msgpack.unpackb(await backing.bus.request(RECORDING_SUBJECT, name))["problem"]
    assert (problem["status"], problem["title"]) == (404, "No such order")


async def test_nobody_answers_when_the_service_has_ended(tmp_path: Path) -> None:
    async with open_context(Settings(data=tmp_path)) as opened:
        app = create_app(opened)
        async with app.router.lifespan_context(app):
            pass
        with pytest.raises(NoResponse):
            await opened.bus.request(RECORDING_SUBJECT, make_request())


GOOD: dict[str, Any] = {"log": "l", "name": "Mine", "begin": 1_000_000, "end": 3_000_000, "camera": [[1, *range(7)]]}


def test_an_order_is_read_as_it_was_sent() -> None:
    order = parse_recording_request(msgpack.packb(GOOD | {"later": "more"}))
    assert (order.log, order.name, order.begin, order.end) == ("l", "Mine", 1_000_000, 3_000_000)
    assert order.camera == [[1, 0, 1, 2, 3, 4, 5, 6]]
    assert order.frame_count == 120
    short = parse_recording_request(msgpack.packb({key: GOOD[key] for key in ("log", "begin", "end")}))
    assert (short.name, short.camera) == (None, [])


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"log": None}, "log"),
        ({"begin": -1}, "begin"),
        ({"end": "late"}, "end"),
        ({"end": 1_000_000}, "seconds"),
        ({"end": 999}, "seconds"),
        ({"end": 2_000_000 + MAX_RECORDING_S * 1_000_000}, "seconds"),
        ({"name": "n" * 201}, "name"),
        ({"camera": [[1, 2]]}, "camera[0]"),
        ({"camera": [[1, *range(7)], [2, *range(6), float("nan")]]}, "camera[1][7]"),
        ({"camera": [[2, *range(7)], [2, *range(7)]]}, "camera"),
    ],
)
def test_what_is_wrong_is_said_with_its_field(change: dict[str, Any], field: str) -> None:
    with pytest.raises(ProblemError) as refused:
        parse_recording_request(msgpack.packb(GOOD | change))
    assert refused.value.status == 422
    assert refused.value.extra["field"] == field


@pytest.mark.parametrize("data", [b"", b"\xc1", b"\x01", b"\x81\x01", msgpack.packb([1])])
def test_what_is_no_order_is_refused(data: bytes) -> None:
    with pytest.raises(ProblemError):
        parse_recording_request(data)
