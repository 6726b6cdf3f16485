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
from tests.time_limit import HANG_TIMEOUT_S


async def post_motion(http: httpx2.AsyncClient, seed: int = 7, seconds: float = 2.0) -> str:
    response = await http.post("/v1/motions", params={"filename": "dance.bvh"}, content=make_bvh_clip(seconds, seed))
    assert response.status_code in (200, 201), response.text
    assert response.json()["tracks"] == ["motion"]
    return str(response.json()["id"])


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
async def test_sound_is_served_in_blocks_at_its_time(server: str, tmp_path: Path, kind: str) -> None:
    path = write_audio(tmp_path / f"song.{kind}", make_click(2.0, 48_000, 1.2, 2), 48_000, "stereo")
    async with httpx2.AsyncClient(base_url=server, timeout=HANG_TIMEOUT_S) as http:
        motion = await post_motion(http)
        before = (await http.get(f"/v1/motions/{motion}")).json()
        response = await post_audio(http, motion, path.read_bytes(), path.name)
        assert response.status_code == 201, response.text
        new = response.json()
        assert response.headers["location"] == f"/v1/motions/{new['id']}"
        assert new["id"] != motion
        assert (new["tracks"], new["made_from"], new["name"]) == (["motion", "audio"], motion, "dance")
        assert new["audio"]["filename"] == path.name
        assert len(new["audio"]["rates"]) == 3
        assert (await http.get(f"/v1/motions/{motion}")).json() == before, "the original is unchanged"
        assert (await http.get(f"/v1/motions/{new['id']}")).json() == new
        repeated = await post_audio(http, motion, path.read_bytes(), "other name")
        assert (repeated.status_code, repeated.json()) == (200, new)
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
        assert block.content == first, "the motion's blocks are the same bytes"


async def test_original_motion_can_be_removed(server: str, tmp_path: Path) -> None:
    path = write_audio(tmp_path / "a.flac", make_tone(1.0, 44_100), 44_100)
    async with httpx2.AsyncClient(base_url=server, timeout=HANG_TIMEOUT_S) as http:
        motion = await post_motion(http, 91)
        new = (await post_audio(http, motion, path.read_bytes())).json()["id"]
        assert (await http.delete(f"/v1/motions/{motion}")).status_code == 204
        assert (await http.get(f"/v1/motions/{new}/blocks/0/0?track=1")).status_code == 200
        missing = await post_audio(http, motion, path.read_bytes())
        assert (missing.status_code, missing.json()["title"]) == (404, "No such motion")


def leftover_files() -> list[Path]:
    return list(Path(tempfile.gettempdir()).glob("bunraku-upload-*/source"))


INVALID_FILES: dict[str, bytes] = {
    "nothing": b"",
    "a motion": make_bvh_clip(0.2),
    "zeros": bytes(100_000),
    "a picture": b"\x89PNG\r\n\x1a\n" + bytes(1000),
    "a header alone": b"RIFF\x24\x00\x00\x00WAVE",
    "MP3 sync bytes": b"\xff\xfb\x90\x00" * 3 + bytes(5000),
}


@pytest.mark.parametrize("name", INVALID_FILES)
async def test_unreadable_sound_is_rejected_and_not_stored(server: str, name: str) -> None:
    async with httpx2.AsyncClient(base_url=server, timeout=HANG_TIMEOUT_S) as http:
        motion = await post_motion(http)
        before = (await http.get("/v1/motions?limit=200")).json()
        response = await post_audio(http, motion, INVALID_FILES[name])
        assert response.status_code == 422, response.text
        assert response.headers["content-type"] == "application/problem+json"
        problem = response.json()
        assert problem["title"]
        assert problem["detail"]
        assert problem["hint"]
        assert tempfile.gettempdir() not in response.text
        assert (await http.get("/v1/motions?limit=200")).json() == before
    assert not leftover_files()


async def test_invalid_request_gets_a_problem(server: str) -> None:
    async with httpx2.AsyncClient(base_url=server, timeout=HANG_TIMEOUT_S) as http:
        assert (await post_audio(http, "none", b"x")).status_code == 404
        motion = await post_motion(http)
        unnamed = await http.post(f"/v1/motions/{motion}/audio", content=b"x")
        assert (unnamed.status_code, unnamed.json()["field"]) == (422, "filename")


async def test_upload_limits_apply_to_sound(tmp_path: Path) -> None:
    sound = write_audio(tmp_path / "a.wav", make_tone(2.0, 48_000), 48_000).read_bytes()
    with run_server(tmp_path / "small", upload_bytes=100_000) as url:
        async with httpx2.AsyncClient(base_url=url, timeout=HANG_TIMEOUT_S) as http:
            motion = await post_motion(http, seconds=0.5)
            assert (await post_audio(http, motion, bytes(100_001))).status_code == 413
    with run_server(tmp_path / "small", upload_seconds=0.001) as url:
        async with httpx2.AsyncClient(base_url=url, timeout=HANG_TIMEOUT_S) as http:
            response = await post_audio(http, motion, sound)
            assert (response.status_code, response.json()["title"]) == (422, "Takes too long")
            assert len((await http.get("/v1/motions")).json()["items"]) == 1


async def test_disconnect_while_sending_stores_nothing(server: str) -> None:
    class Disconnect(Exception):
        pass

    async def send_half() -> AsyncIterator[bytes]:
        yield b"RIFF"
        raise Disconnect

    async with httpx2.AsyncClient(base_url=server, timeout=HANG_TIMEOUT_S) as http:
        motion = await post_motion(http)
        before = (await http.get("/v1/motions?limit=200")).json()
        with pytest.raises(Disconnect):
            await http.post(f"/v1/motions/{motion}/audio", params={"filename": "x.wav"}, content=send_half())
        assert (await http.get("/v1/motions?limit=200")).json() == before
