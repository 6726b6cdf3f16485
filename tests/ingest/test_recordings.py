from __future__ import annotations

import asyncio
import multiprocessing
import secrets
from collections.abc import AsyncIterator
from pathlib import Path
from typing import Any

import msgpack
import pytest

from bunraku.backing.backing import Backing, open_backing
from bunraku.backing.bus import NobodyAnswers
from bunraku.backing.order import MOST_SECONDS
from bunraku.backing.problems import ProblemError
from bunraku.backing.settings import Settings
from bunraku.ingest import recordings
from bunraku.ingest.app import create_app
from bunraku.ingest.recordings import SUBJECT, read_order
from bunraku.ingest.uploads import Uploads
from bunraku.marionette.log import Log
from bunraku.playout import timeline
from tests.servers import clip

BEGAN = 1_700_000_000_000_000
SECOND = 1_000_000


@pytest.fixture
async def backing(tmp_path: Path) -> AsyncIterator[Backing]:
    async with open_backing(Settings(data=tmp_path / "data")) as opened:
        app = create_app(opened)
        async with app.router.lifespan_context(app):
            yield opened


@pytest.fixture
async def dance(backing: Backing, tmp_path: Path) -> str:
    """A dance of 2 s in the library, with a log \"log\" of a session that played it."""
    source = tmp_path / "source"
    source.write_bytes(clip(2.0, 51))
    entry, _ = await Uploads(backing).add("dance", source, "Swan.bvh")
    log = Log()
    log.timeline(timeline.start(entry.id, 2 * SECOND, BEGAN))
    await backing.library.put_log("log", log.pack())
    return entry.id


def order(**change: Any) -> bytes:
    values = {"log": "log", "name": None, "begin": BEGAN, "end": BEGAN + SECOND, "camera": []} | change
    packed: bytes = msgpack.packb(values)
    return packed


async def ask(backing: Backing, message: bytes) -> dict[str, Any]:
    name = f"order-{secrets.token_hex(4)}"
    await backing.library.put_log(name, message)
    said: dict[str, Any] = msgpack.unpackb(await backing.bus.ask(SUBJECT, name.encode(), seconds=60))
    return said


async def test_a_session_becomes_a_motion_of_the_library(backing: Backing, dance: str) -> None:
    camera = [[float(BEGAN), 0.0, 1.2, 4.0, 0.0, 1.0, 0.0, 0.5]]
    motion = (await ask(backing, order(camera=camera)))["motion"]
    entry = await backing.catalogue.get(motion["id"])
    stored = await backing.library.get(motion["id"])
    known = await backing.catalogue.get(dance)
    assert entry is not None
    assert stored is not None
    assert known is not None
    assert motion["name"] == "Swan, kept"
    assert motion["source"] == f"kept from a session of Swan ({dance})"
    assert (motion["duration"], motion["frames"], motion["fps"]) == (1.0, 60, 60)
    assert motion["tracks"] == ["motion", "camera"]
    assert motion["joints"] == known.description["joints"]
    assert [len(track[0]) for track in stored.packets] == [2, 2]
    named = (await ask(backing, order(name=" My duet ")))["motion"]
    assert named["name"] == "My duet"
    assert named["id"] != motion["id"]
    page, _ = await backing.catalogue.page(9)
    assert [e.id for e in page] == [named["id"], motion["id"], dance]


@pytest.mark.parametrize(
    ("change", "status", "field"),
    [
        ({"log": "another"}, 404, "log"),
        ({"log": "../motions/dance"}, 404, "log"),
        ({"end": BEGAN}, 422, "seconds"),
        ({"begin": BEGAN - 2 * SECOND, "end": BEGAN - SECOND}, 422, "seconds"),
        ({"camera": [[float(BEGAN), 0, 1, 4, 0, 1, 0, 9.0]]}, 422, "camera"),
    ],
)
async def test_what_cannot_be_kept_is_a_problem_and_nothing_is_stored(
    backing: Backing, dance: str, change: dict[str, Any], status: int, field: str
) -> None:
    problem = (await ask(backing, order(**change)))["problem"]
    assert (problem["status"], problem["field"]) == (status, field)
    assert problem["title"]
    assert problem["detail"]
    assert [e.id for e in (await backing.catalogue.page(9))[0]] == [dance]


async def test_a_log_that_cannot_be_read_is_a_problem(backing: Backing, dance: str) -> None:
    await backing.library.put_log("log", b"\xc1")
    problem = (await ask(backing, order()))["problem"]
    assert problem["status"] == 422
    assert problem["title"] == "Unreadable log"
    assert [e.id for e in (await backing.catalogue.page(9))[0]] == [dance]


async def test_a_dance_that_was_removed_cannot_be_kept(backing: Backing, dance: str) -> None:
    await backing.library.remove(dance)
    assert (await ask(backing, order()))["problem"]["title"] == "Cannot be replayed"


@pytest.mark.usefixtures("dance")
async def test_more_than_may_wait_are_told_to_come_again(backing: Backing, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recordings, "WAITING", 1)
    one, other = await asyncio.gather(ask(backing, order()), ask(backing, order()))
    kept, told = (one, other) if "motion" in one else (other, one)
    assert "motion" in kept
    assert told["problem"]["status"] == 503
    assert "motion" in await ask(backing, order())


async def test_one_that_takes_too_long_is_ended(backing: Backing, dance: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(recordings, "SECONDS", 0.001)
    problem = (await ask(backing, order()))["problem"]
    assert (problem["status"], problem["title"]) == (503, "Busy")
    assert [e.id for e in (await backing.catalogue.page(9))[0]] == [dance]


async def test_one_who_no_longer_waits_leaves_nothing_behind(backing: Backing, dance: str) -> None:
    await backing.library.put_log("order", order())
    with pytest.raises(NobodyAnswers):
        await backing.bus.ask(SUBJECT, b"order", seconds=0.1)
    assert not multiprocessing.active_children()
    assert [e.id for e in (await backing.catalogue.page(9))[0]] == [dance]
    assert "motion" in await ask(backing, order())


@pytest.mark.parametrize("name", [b"none", b"../log", b"\xff", b""])
async def test_an_order_that_is_not_there_is_said_so(backing: Backing, name: bytes) -> None:
    problem = msgpack.unpackb(await backing.bus.ask(SUBJECT, name))["problem"]
    assert (problem["status"], problem["title"]) == (404, "No such order")


async def test_nobody_answers_when_the_service_has_ended(tmp_path: Path) -> None:
    async with open_backing(Settings(data=tmp_path)) as opened:
        app = create_app(opened)
        async with app.router.lifespan_context(app):
            pass
        with pytest.raises(NobodyAnswers):
            await opened.bus.ask(SUBJECT, order())


GOOD: dict[str, Any] = {"log": "l", "name": "Mine", "begin": 1_000_000, "end": 3_000_000, "camera": [[1, *range(7)]]}


def test_an_order_is_read_as_it_was_sent() -> None:
    order = read_order(msgpack.packb(GOOD | {"later": "more"}))
    assert (order.log, order.name, order.begin, order.end) == ("l", "Mine", 1_000_000, 3_000_000)
    assert order.camera == [[1, 0, 1, 2, 3, 4, 5, 6]]
    assert order.frames == 120
    short = read_order(msgpack.packb({key: GOOD[key] for key in ("log", "begin", "end")}))
    assert (short.name, short.camera) == (None, [])


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"log": None}, "log"),
        ({"begin": -1}, "begin"),
        ({"end": "late"}, "end"),
        ({"end": 1_000_000}, "seconds"),
        ({"end": 999}, "seconds"),
        ({"end": 2_000_000 + MOST_SECONDS * 1_000_000}, "seconds"),
        ({"name": "n" * 201}, "name"),
        ({"camera": [[1, 2]]}, "camera[0]"),
        ({"camera": [[1, *range(7)], [2, *range(6), float("nan")]]}, "camera[1][7]"),
        ({"camera": [[2, *range(7)], [2, *range(7)]]}, "camera"),
    ],
)
def test_what_is_wrong_is_said_with_its_field(change: dict[str, Any], field: str) -> None:
    with pytest.raises(ProblemError) as refused:
        read_order(msgpack.packb(GOOD | change))
    assert refused.value.status == 422
    assert refused.value.extra["field"] == field


@pytest.mark.parametrize("data", [b"", b"\xc1", b"\x01", b"\x81\x01", msgpack.packb([1])])
def test_what_is_no_order_is_refused(data: bytes) -> None:
    with pytest.raises(ProblemError):
        read_order(data)
