from __future__ import annotations

from pathlib import Path

import httpx2
import pytest

from bunraku.client import Client, ServerProblem, api
from tests.audio import make_tone, write_audio
from tests.servers import make_bvh_clip


async def test_upload_tells_how_far_it_is_and_what_was_made(server: str, clip_file: Path) -> None:
    told: list[tuple[int, int]] = []
    async with Client(server) as client:
        motion = await client.upload(clip_file, lambda sent, size: told.append((sent, size)))
        assert await client.motion(motion["id"]) == motion
        assert motion["id"] in [m["id"] for m in await client.motions()]
        await client.delete_motion(motion["id"])
        with pytest.raises(ServerProblem) as gone:
            await client.motion(motion["id"])
    assert gone.value.status == 404
    assert told[-1] == (motion["bytes"],) * 2
    assert told == sorted(told)


async def test_upload_tells_what_the_server_does_with_it(
    server: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(api, "PROGRESS_INTERVAL_S", 0.01)
    told: list[tuple[str, float]] = []
    path = tmp_path / "long.bvh"
    path.write_bytes(make_bvh_clip(20.0, 77))
    async with Client(server) as client:
        await client.upload(path, on_stage=lambda stage, share: told.append((stage, share)))
    assert {stage for stage, _ in told} <= {"waiting", "reading", "encoding"}
    shares = [share for stage, share in told if stage == "encoding"]
    assert len(set(shares)) > 1
    assert shares == sorted(shares)


async def test_sound_is_added_to_a_motion(server: str, clip_file: Path, tmp_path: Path) -> None:
    told: list[tuple[int, int]] = []
    song = write_audio(tmp_path / "song.flac", make_tone(1.0, 44_100, 2), 44_100, "stereo")
    async with Client(server) as client:
        motion = await client.upload(clip_file)
        sung = await client.add_audio(motion["id"], song, lambda sent, size: told.append((sent, size)))
        assert await client.motion(sung["id"]) == sung
        assert (sung["made_from"], sung["tracks"]) == (motion["id"], ["motion", "audio"])
        with pytest.raises(ServerProblem, match="Not a sound"):
            await client.add_audio(motion["id"], clip_file)
        with pytest.raises(ServerProblem, match="No such motion"):
            await client.add_audio("none", song)
    assert told[-1] == (song.stat().st_size,) * 2


async def test_a_refusal_says_line_and_hint(server: str, tmp_path: Path) -> None:
    bad = tmp_path / "bad.bvh"
    bad.write_text("HIERARCHY\nROOT hips\n{\nOFFSET 0 0 zero\n")
    async with Client(server) as client:
        with pytest.raises(ServerProblem, match=r"line 4.*\("):
            await client.upload(bad)


async def test_where_nobody_answers_it_says_so() -> None:
    async with Client("http://127.0.0.1:9") as client:
        with pytest.raises(httpx2.TransportError):
            await client.motions()


def test_socket_addresses_follow_the_servers() -> None:
    assert Client("https://stage.example/here/").socket_url("/v1/x") == "wss://stage.example/here/v1/x"


async def test_library_is_searched_labelled_edited_and_drawn(server: str, clip_file: Path) -> None:
    stages: list[tuple[str, float]] = []
    async with Client(server) as client:
        motion = (await client.upload(clip_file))["id"]
        labelled = await client.update_motion(motion, name="Wasserfall", tags=["water"])
        assert (labelled["name"], labelled["tags"]) == ("Wasserfall", ["water"])
        assert (await client.update_motion(motion, tags=["River"]))["name"] == "Wasserfall"
        assert [found["id"] for found in await client.motions("FALL wasser", tag="river")] == [motion]
        assert await client.motions(search="wasser", tag="water") == []
        edited = await client.edit_motion(
            motion,
            start=0.1,
            end=0.5,
            mirror=True,
            name="M",
            on_stage=lambda stage, share: stages.append((stage, share)),
        )
        assert (edited["name"], edited["tags"], edited["made_from"]) == ("M", ["River"], motion)
        assert edited["duration"] == pytest.approx(0.4, abs=0.04)
        assert (await client.thumbnail(motion)).startswith(b"<svg")
        with pytest.raises(ServerProblem) as raised:
            await client.thumbnail("none")
        assert raised.value.status == 404
        with pytest.raises(ServerProblem, match="visible"):
            await client.update_motion(motion, name=" ")
    assert {stage for stage, _ in stages} <= {"waiting", "reading", "encoding"}
