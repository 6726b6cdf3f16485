from __future__ import annotations

import asyncio
from collections.abc import Iterator
from contextlib import AsyncExitStack
from functools import cache
from pathlib import Path

import pytest

from bunraku import demo
from bunraku.backing.backing import open_backing
from bunraku.backing.settings import Settings
from bunraku.motion import choreography
from bunraku.motion.skeleton import Motion
from bunraku.music import sanbaso
from bunraku.session.sessions import Sessions
from tests.processes import jetstream, postgres, url_of


@pytest.fixture(scope="module", autouse=True)
def _music_is_made_once() -> Iterator[None]:
    """It takes seconds, and is the same each time."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sanbaso, "music", cache(sanbaso.music))
        yield


@pytest.fixture
def danced(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """One entry for each time that the dance was made: its frames a second, few, as it is encoded each time."""
    rates: list[float] = []
    dance = choreography.dance

    def counted(fps: float = 60.0) -> Motion:
        rates.append(fps / 5)
        return dance(rates[-1])

    monkeypatch.setattr(choreography, "dance", counted)
    return rates


async def test_the_dance_is_taken_in_once_and_again_when_it_was_removed(tmp_path: Path, danced: list[float]) -> None:
    async with open_backing(Settings(data=tmp_path)) as backing:
        motion = await demo.add_demo(backing)
        entry = await backing.catalogue.get(motion)
        assert entry is not None
        assert entry.description["name"] == choreography.TITLE
        assert entry.description["duration"] >= 20
        assert entry.description["tracks"] == ["motion", "audio", "camera", "light", "light", "light"]
        assert entry.description["audio"]["seconds"] == pytest.approx(entry.description["duration"])
        entries, _ = await backing.catalogue.page(10)
        assert [entry.id for entry in entries] == [motion], "what was on the way is not kept"
        assert await demo.add_demo(backing) == motion
        assert len(danced) == 1
        await backing.catalogue.remove(motion)
        await backing.library.remove(motion)
        await backing.library.put_note(demo.NOTE, b"[]")
        assert await demo.add_demo(backing) == motion
        assert len(danced) == 2
        assert await backing.library.get(motion) is not None


@pytest.mark.usefixtures("danced")
async def test_a_dance_made_by_other_code_makes_room_for_the_new_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with open_backing(Settings(data=tmp_path)) as backing:
        monkeypatch.setattr(choreography, "TITLE", "Older")
        await demo.add_demo(backing)
        monkeypatch.setattr(choreography, "TITLE", "Newer")
        monkeypatch.setattr(demo, "_fingerprint", lambda: "other code")
        await demo.add_demo(backing)
        entries, _ = await backing.catalogue.page(10)
        assert [entry.description["name"] for entry in entries] == ["Newer"]


async def test_of_replicas_that_start_at_once_one_makes_the_dance_and_one_opens_its_stage(
    tmp_path: Path, danced: list[float]
) -> None:
    (tmp_path / "nats").mkdir()
    async with AsyncExitStack() as stack:
        database, bus = stack.enter_context(postgres()), stack.enter_context(jetstream(tmp_path / "nats"))
        shared = Settings(
            data=tmp_path / "data",
            catalogue=f"postgresql://postgres@127.0.0.1:{database.port}/postgres",
            library=f"file://{tmp_path}/library",
            bus=url_of(bus),
        )
        replicas = []
        for _ in range(3):
            backing = await stack.enter_async_context(open_backing(shared))
            replicas.append((backing, Sessions(backing)))
            stack.push_async_callback(replicas[-1][1].close)
        async with asyncio.timeout(90):
            await asyncio.gather(*(demo.open_stage(backing, sessions) for backing, sessions in replicas))
        assert len(danced) == 1
        backing, sessions = replicas[0]
        (motion,) = [entry.id for entry in (await backing.catalogue.page(10))[0]]
        found, _ = await sessions.page(10, None)
        assert [(session["motion"], session["playing"]) for session in found] == [(motion, True)]
        # and one that comes later finds both
        await demo.open_stage(*replicas[2])
        assert len(danced) == 1
        assert len((await sessions.page(10, None))[0]) == 1
