from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from bunraku import demo
from bunraku.backing.backing import open_backing
from bunraku.backing.settings import Settings
from bunraku.motion import choreography
from bunraku.music import sanbaso


@pytest.fixture(scope="module", autouse=True)
def _music_is_made_once() -> Iterator[None]:
    """It takes seconds, and is the same each time."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sanbaso, "music", cache(sanbaso.music))
        yield


async def test_the_dance_is_taken_in_once_and_again_when_it_was_removed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    danced = 0
    dance = choreography.dance

    def counted(fps: float = 60.0) -> object:
        nonlocal danced
        danced += 1
        # few frames, as it is encoded each time
        return dance(fps / 5)

    monkeypatch.setattr(choreography, "dance", counted)
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
        assert danced == 1
        await backing.catalogue.remove(motion)
        await backing.library.remove(motion)
        (tmp_path / "demo.json").write_text("[]")
        assert await demo.add_demo(backing) == motion
        assert danced == 2
        assert await backing.library.get(motion) is not None


async def test_a_dance_made_by_other_code_makes_room_for_the_new_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    async with open_backing(Settings(data=tmp_path)) as backing:
        dance = choreography.dance
        monkeypatch.setattr(choreography, "dance", lambda fps=60.0: dance(fps / 5))
        monkeypatch.setattr(choreography, "TITLE", "Older")
        await demo.add_demo(backing)
        monkeypatch.setattr(choreography, "TITLE", "Newer")
        monkeypatch.setattr(demo, "_fingerprint", lambda: "other code")
        await demo.add_demo(backing)
        entries, _ = await backing.catalogue.page(10)
        assert [entry.description["name"] for entry in entries] == ["Newer"]
