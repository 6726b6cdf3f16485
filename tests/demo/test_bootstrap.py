from __future__ import annotations

import asyncio
from collections.abc import Iterator
from contextlib import AsyncExitStack
from functools import cache
from pathlib import Path

import pytest

from bunraku.demo import bootstrap, choreography, music
from bunraku.motion.skeleton import Motion
from bunraku.runtime.context import open_context
from bunraku.runtime.settings import Settings
from bunraku.session.session_manager import SessionManager
from tests.processes import nats_url_of, run_jetstream, run_postgres
from tests.time_limit import HANG_TIMEOUT_S


@pytest.fixture(scope="module", autouse=True)
def _music_is_made_once() -> Iterator[None]:
    """It takes seconds, and is the same each time."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(music, "render_music", cache(music.render_music))
        yield


@pytest.fixture
def danced(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """One entry for each time that the dance was made: its frames a second, few, as it is encoded each time."""
    rates: list[float] = []
    dance = choreography.animate_dance

    def counted(fps: float = 60.0) -> Motion:
        rates.append(fps / 5)
        return dance(rates[-1])

    monkeypatch.setattr(choreography, "animate_dance", counted)
    return rates


async def test_demo_is_created_once_and_again_after_removal(tmp_path: Path, danced: list[float]) -> None:
    async with open_context(Settings(data=tmp_path)) as backing:
        motion = await bootstrap.ensure_demo_motion(backing)
        entry = await backing.catalogue.get_motion(motion)
        assert entry is not None
        assert entry.description["name"] == choreography.TITLE
        assert entry.description["duration"] >= 20
        assert entry.description["tracks"] == ["motion", "audio", "camera", "light", "light", "light"]
        assert entry.description["audio"]["seconds"] == pytest.approx(entry.description["duration"])
        entries, _ = await backing.catalogue.list_motions(10)
        assert [entry.id for entry in entries] == [motion], "what was on the way is not kept"
        assert await bootstrap.ensure_demo_motion(backing) == motion
        assert len(danced) == 1
        await backing.catalogue.remove_motion(motion)
        await backing.motion_store.remove(motion)
        await backing.motion_store.put_note(bootstrap.DEMO_NOTE_KEY, b"[]")
        assert await bootstrap.ensure_demo_motion(backing) == motion
        assert len(danced) == 2
        assert await backing.motion_store.get(motion) is not None


@pytest.mark.usefixtures("danced")
async def test_demo_of_other_code_is_replaced(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    async with open_context(Settings(data=tmp_path)) as backing:
        monkeypatch.setattr(choreography, "TITLE", "Older")
        await bootstrap.ensure_demo_motion(backing)
        monkeypatch.setattr(choreography, "TITLE", "Newer")
        monkeypatch.setattr(bootstrap, "_code_fingerprint", lambda: "other code")
        await bootstrap.ensure_demo_motion(backing)
        entries, _ = await backing.catalogue.list_motions(10)
        assert [entry.description["name"] for entry in entries] == ["Newer"]


async def test_concurrent_replicas_create_one_motion_and_one_session(tmp_path: Path, danced: list[float]) -> None:
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
        assert len(danced) == 1
        backing, sessions = replicas[0]
        (motion,) = [entry.id for entry in (await backing.catalogue.list_motions(10))[0]]
        found, _ = await sessions.list_sessions(10, None)
        assert [(session["motion"], session["playing"]) for session in found] == [(motion, True)]
        # and one that comes later finds both
        await bootstrap.open_demo_stage(*replicas[2])
        assert len(danced) == 1
        assert len((await sessions.list_sessions(10, None))[0]) == 1
