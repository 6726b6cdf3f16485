from __future__ import annotations

import tempfile
from collections.abc import AsyncIterator
from pathlib import Path

import httpx2
import pytest

from bunraku.codec.audio import AudioTrack, parse_audio_track, unpack_audio_block
from bunraku.codec.motion_track import parse_motion_track
from bunraku.wire.messages import Data, Description, unpack
from tests.audio import AUDIO_FORMATS, decode_opus, find_onset, make_click, make_tone, write_audio
from tests.servers import make_bvh_clip, run_server


async def post_motion(http: httpx2.AsyncClient, seed: int = 7, seconds: float = 2.0) -> str:
    answer = await http.post("/v1/motions", params={"filename": "dance.bvh"}, content=make_bvh_clip(seconds, seed))
    assert answer.status_code in (200, 201), answer.text
    assert answer.json()["tracks"] == ["motion"]
    return str(answer.json()["id"])


async def post_audio(http: httpx2.AsyncClient, motion: str, data: bytes, filename: str = "song.wav") -> httpx2.Response:
    return await http.post(f"/v1/motions/{motion}/audio", params={"filename": filename}, content=data)


async def get_audio_track(http: httpx2.AsyncClient, motion: str) -> tuple[AudioTrack, int]:
    description = unpack((await http.get(f"/v1/motions/{motion}/description")).content)
    assert isinstance(description, Description)
    assert description.motion == motion
    kinds = [track["type"] for track in description.tracks]
    number = kinds.index("audio")
    return parse_audio_track(description.tracks[number], parse_motion_track(description.tracks[0])), number


@pytest.mark.parametrize("kind", AUDIO_FORMATS)
async def test_a_sound_is_played_at_its_place_from_the_servers_blocks(server: str, tmp_path: Path, kind: str) -> None:
    path = write_audio(tmp_path / f"song.{kind}", make_click(2.0, 48_000, 1.2, 2), 48_000, "stereo")
    async with httpx2.AsyncClient(base_url=server, timeout=60) as http:
        motion = await post_motion(http)
        before = (await http.get(f"/v1/motions/{motion}")).json()
        answer = await post_audio(http, motion, path.read_bytes(), path.name)
        assert answer.status_code == 201, answer.text
        new = answer.json()
        assert answer.headers["location"] == f"/v1/motions/{new['id']}"
        assert new["id"] != motion
        assert (new["tracks"], new["made_from"], new["name"]) == (["motion", "audio"], motion, "dance")
        assert new["audio"]["filename"] == path.name
        assert len(new["audio"]["rates"]) == 3
        assert (await http.get(f"/v1/motions/{motion}")).json() == before, "what was there stays as it was"
        assert (await http.get(f"/v1/motions/{new['id']}")).json() == new
        again = await post_audio(http, motion, path.read_bytes(), "other name")
        assert (again.status_code, again.json()) == (200, new)
        listed = (await http.get("/v1/motions?limit=200")).json()["items"]
        tracks = {item["id"]: item["tracks"] for item in listed}
        assert (tracks[motion], tracks[new["id"]]) == (["motion"], ["motion", "audio"])

        track, number = await get_audio_track(http, new["id"])
        for rate in range(3):
            packets: list[bytes] = []
            for index in range(track.block_count):
                block = await http.get(f"/v1/motions/{new['id']}/blocks/{rate}/{index}?track={number}")
                assert "immutable" in block.headers["cache-control"]
                packets += [packet.data for packet in unpack_audio_block(Data.unpack(block.content).block)]
            played = decode_opus(packets)[track.pre_skip :][: track.samples]
            assert abs(find_onset(played[:, 0]) - find_onset(make_click(2.0, 48_000, 1.2)[:, 0])) < 1e-3
        for old in (motion, new["id"]):
            block = await http.get(f"/v1/motions/{old}/blocks/2/1")
            assert block.status_code == 200
        first = (await http.get(f"/v1/motions/{motion}/blocks/2/1")).content
        assert block.content == first, "the dance's blocks are the same bytes"


async def test_the_motion_that_a_sound_was_added_to_can_go(server: str, tmp_path: Path) -> None:
    path = write_audio(tmp_path / "a.flac", make_tone(1.0, 44_100), 44_100)
    async with httpx2.AsyncClient(base_url=server, timeout=60) as http:
        motion = await post_motion(http, 91)
        new = (await post_audio(http, motion, path.read_bytes())).json()["id"]
        assert (await http.delete(f"/v1/motions/{motion}")).status_code == 204
        assert (await http.get(f"/v1/motions/{new}/blocks/0/0?track=1")).status_code == 200
        gone = await post_audio(http, motion, path.read_bytes())
        assert (gone.status_code, gone.json()["title"]) == (404, "No such motion")


def leftover_files() -> list[Path]:
    return list(Path(tempfile.gettempdir()).glob("bunraku-upload-*/source"))


HARM: dict[str, bytes] = {
    "nothing": b"",
    "a motion": make_bvh_clip(0.2),
    "zeros": bytes(100_000),
    "a picture": b"\x89PNG\r\n\x1a\n" + bytes(1000),
    "a head alone": b"RIFF\x24\x00\x00\x00WAVE",
    "what looks like MP3": b"\xff\xfb\x90\x00" * 3 + bytes(5000),
}


@pytest.mark.parametrize("harm", HARM)
async def test_what_is_no_sound_is_refused_in_words_and_leaves_nothing(server: str, harm: str) -> None:
    async with httpx2.AsyncClient(base_url=server, timeout=60) as http:
        motion = await post_motion(http)
        before = (await http.get("/v1/motions?limit=200")).json()
        answer = await post_audio(http, motion, HARM[harm])
        assert answer.status_code == 422, answer.text
        assert answer.headers["content-type"] == "application/problem+json"
        problem = answer.json()
        assert problem["title"]
        assert problem["detail"]
        assert problem["hint"]
        assert tempfile.gettempdir() not in answer.text
        assert (await http.get("/v1/motions?limit=200")).json() == before
    assert not leftover_files()


async def test_wrong_questions_get_problems(server: str) -> None:
    async with httpx2.AsyncClient(base_url=server, timeout=60) as http:
        assert (await post_audio(http, "none", b"x")).status_code == 404
        motion = await post_motion(http)
        nameless = await http.post(f"/v1/motions/{motion}/audio", content=b"x")
        assert (nameless.status_code, nameless.json()["field"]) == (422, "filename")


async def test_limits_of_size_and_time_hold_for_sound_too(tmp_path: Path) -> None:
    sound = write_audio(tmp_path / "a.wav", make_tone(2.0, 48_000), 48_000).read_bytes()
    with run_server(tmp_path / "small", upload_bytes=100_000) as url:
        async with httpx2.AsyncClient(base_url=url, timeout=60) as http:
            motion = await post_motion(http, seconds=0.5)
            assert (await post_audio(http, motion, bytes(100_001))).status_code == 413
    with run_server(tmp_path / "small", upload_seconds=0.001) as url:
        async with httpx2.AsyncClient(base_url=url, timeout=60) as http:
            answer = await post_audio(http, motion, sound)
            assert (answer.status_code, answer.json()["title"]) == (422, "Takes too long")
            assert len((await http.get("/v1/motions")).json()["items"]) == 1


async def test_one_who_goes_away_while_sending_leaves_nothing(server: str) -> None:
    class Gone(Exception):
        pass

    async def half() -> AsyncIterator[bytes]:
        yield b"RIFF"
        raise Gone

    async with httpx2.AsyncClient(base_url=server, timeout=60) as http:
        motion = await post_motion(http)
        before = (await http.get("/v1/motions?limit=200")).json()
        with pytest.raises(Gone):
            await http.post(f"/v1/motions/{motion}/audio", params={"filename": "x.wav"}, content=half())
        assert (await http.get("/v1/motions?limit=200")).json() == before
