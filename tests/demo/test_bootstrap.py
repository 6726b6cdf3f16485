from __future__ import annotations

import asyncio
import json
from contextlib import AsyncExitStack
from pathlib import Path

import pytest

from bunraku.demo import bootstrap
from bunraku.runtime.context import open_context
from bunraku.runtime.settings import Settings
from bunraku.session.session_manager import SessionManager
from tests.processes import nats_url_of, run_jetstream, run_postgres
from tests.time_limit import HANG_TIMEOUT_S

MOTION = json.loads(bootstrap.DESCRIPTION_FILE.read_bytes())["id"]


@pytest.fixture
def reads(monkeypatch: pytest.MonkeyPatch) -> list[Path]:
    """One entry for each time that the motion was read from the package, to be stored."""
    found: list[Path] = []
    read_bytes = Path.read_bytes

    def counted(path: Path) -> bytes:
        if path == bootstrap.MOTION_FILE:
            found.append(path)
        return read_bytes(path)

    monkeypatch.setattr(Path, "read_bytes", counted)
    return found


async def test_demo_is_stored_once_and_again_after_removal(tmp_path: Path, reads: list[Path]) -> None:
    async with open_context(Settings(data=tmp_path)) as backing:
        assert await bootstrap.ensure_demo_motion(backing) == MOTION
        entries, _ = await backing.catalogue.list_motions(10)
        assert [(entry.id, entry.description["name"]) for entry in entries] == [(MOTION, "Sanbasō, First Steps")]
        assert await bootstrap.ensure_demo_motion(backing) == MOTION
        assert len(reads) == 1
        await backing.catalogue.remove_motion(MOTION)
        await backing.motion_store.put_note(bootstrap.DEMO_NOTE_KEY, b"[]")
        assert await bootstrap.ensure_demo_motion(backing) == MOTION
        assert len(reads) == 2
        # the object is lost, the entry is not
        await backing.motion_store.remove(MOTION)
        assert await bootstrap.ensure_demo_motion(backing) == MOTION
        assert await backing.motion_store.get(MOTION) is not None
        assert len((await backing.catalogue.list_motions(10))[0]) == 1


async def test_demo_of_another_release_is_replaced(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    other = tmp_path / "dance.json"
    values = json.loads(bootstrap.DESCRIPTION_FILE.read_bytes())
    other.write_text(json.dumps({"id": "a" * 20, "description": values["description"] | {"name": "Older"}}))
    async with open_context(Settings(data=tmp_path / "data")) as backing:
        with monkeypatch.context() as patch:
            patch.setattr(bootstrap, "DESCRIPTION_FILE", other)
            assert await bootstrap.ensure_demo_motion(backing) == "a" * 20
        await bootstrap.ensure_demo_motion(backing)
        entries, _ = await backing.catalogue.list_motions(10)
        assert [entry.id for entry in entries] == [MOTION]
        assert await backing.motion_store.get("a" * 20) is None


async def test_concurrent_replicas_store_one_motion_and_open_one_session(tmp_path: Path, reads: list[Path]) -> None:
    (tmp_path / "nats").mkdir()
    async with AsyncExitStack() as stack:
        database, bus = stack.enter_context(run_postgres()), stack.enter_context(run_jetstream(tmp_path / "nats"))
        shared = Settings(
            data=tmp_path / "data",
            catalogue=f"postgresql://postgres@127.0.0.1:{database.port}/postgres",
            library=f"file://{tmp_path}/library",
            bus=nats_url_of(bus),
        )
        replicas = []
        for _ in range(3):
            backing = await stack.enter_async_context(open_context(shared))
            replicas.append((backing, SessionManager(backing)))
            stack.push_async_callback(replicas[-1][1].close)
        async with asyncio.timeout(HANG_TIMEOUT_S):
            await asyncio.gather(*(bootstrap.open_demo_stage(backing, sessions) for backing, sessions in replicas))
        assert len(reads) == 1
        backing, sessions = replicas[0]
        assert [entry.id for entry in (await backing.catalogue.list_motions(10))[0]] == [MOTION]
        found, _ = await sessions.list_sessions(10, None)
        assert [(session["motion"], session["playing"]) for session in found] == [(MOTION, True)]
        # and one that comes later finds both
        await bootstrap.open_demo_stage(*replicas[2])
        assert len(reads) == 1
        assert len((await sessions.list_sessions(10, None))[0]) == 1
