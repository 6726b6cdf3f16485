from __future__ import annotations

import asyncio
from pathlib import Path
from urllib.parse import urlsplit

import httpx2
import pytest
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed

from bunraku.client import Client
from bunraku.codec.motion_track import parse_motion_track
from bunraku.runtime.clock import clock
from bunraku.wire.messages import (
    SUBPROTOCOL,
    ChannelHeader,
    Choice,
    Claim,
    Data,
    Description,
    Edit,
    Message,
    Ping,
    Pong,
    Problem,
    Report,
    TimelineState,
    unpack,
)
from tests.motion.extended_source import extended_source, write_source_bvh
from tests.motion.hand_source import hand_source
from tests.servers import make_bvh_clip
from tests.time_limit import HANG_TIMEOUT_S


def socket(server: str, path: str, protocol: str = SUBPROTOCOL) -> connect:
    address = f"ws://{urlsplit(server).netloc}{path}"
    return connect(address, subprotocols=[protocol], compression=None)  # type: ignore[list-item]


async def message(connection: ClientConnection) -> Message | None:
    data = await asyncio.wait_for(connection.recv(), HANG_TIMEOUT_S)
    assert isinstance(data, bytes)
    return unpack(data)


async def receive_until(connection: ClientConnection, kind: type) -> Message:
    while not isinstance(found := await message(connection), kind):
        assert not isinstance(found, Problem), found
    assert found is not None
    return found


@pytest.fixture
async def motion(server: str, clip_file: Path) -> str:
    async with Client(server) as client:
        return str((await client.upload(clip_file))["id"])


async def test_server_sends_header_description_and_timeline_first(server: str, motion: str) -> None:
    begin = clock()
    async with socket(server, f"/v1/motions/{motion}/stream") as connection:
        assert connection.subprotocol == SUBPROTOCOL
        kinds = [await message(connection) for _ in range(6)]
        end = clock()
    header, description, timeline, *data = kinds
    assert isinstance(header, ChannelHeader)
    assert (header.motion, header.channels, header.clock) == (motion, 19, "unix")
    assert isinstance(description, Description)
    assert isinstance(timeline, TimelineState)
    assert begin <= timeline.clock <= end
    assert begin <= header.now <= end
    track = parse_motion_track(description.tracks[0])
    best = len(description.tracks[0]["rates"]) - 1
    assert [(d.index, d.rate) for d in data if isinstance(d, Data)] == [
        (0, 0),
        *((index, best) for index in (1, 2)),
    ]
    assert track.start_us(1) == 500_000


async def test_pinned_level_is_kept_after_first_block(server: str, motion: str) -> None:
    async with socket(server, f"/v1/motions/{motion}/stream?rate=1") as connection:
        rates = [data.rate for _ in range(6) if isinstance(data := await message(connection), Data)]
    assert rates == [0, 1, 1]


async def test_stream_without_motion_track_has_no_blocks(server: str, motion: str) -> None:
    async with socket(server, f"/v1/motions/{motion}/stream?tracks=camera,light") as connection:
        await receive_until(connection, TimelineState)
        await connection.send(Ping(1, 2).pack())
        assert isinstance(await message(connection), Pong)


async def test_extensions_are_sent_only_on_request(server: str) -> None:
    async with httpx2.AsyncClient(base_url=server, timeout=HANG_TIMEOUT_S) as http:
        uploaded = await http.post(
            "/v1/motions?filename=dance.bvh", content=write_source_bvh(extended_source(45, seed=5))
        )
        motion = uploaded.json()
    # the body and the contacts of the feet
    assert motion["tracks"] == ["motion", "extension", "extension"]
    received: dict[str, set[int]] = {}
    described: dict[str, int] = {}
    for query in (
        "",
        "?extensions=true",
        "?tracks=motion&extensions=true",
        "?extensions=true&parts=contacts",
        "?extensions=false",
    ):
        tracks: set[int] = set()
        described[query] = 0
        async with socket(server, f"/v1/motions/{motion['id']}/stream{query}") as connection:
            # two blocks of each track, and upgrades of some
            while len(tracks) < (2 if "true" in query else 1) or described[query] == 0:
                if isinstance(data := await message(connection), Data):
                    tracks.add(data.track)
                elif isinstance(data, Description):
                    described[query] = max(described[query], (data.first or 0) + len(data.tracks))
            await connection.send(Ping(1, 2).pack())
            while not isinstance(data := await message(connection), Pong):
                if isinstance(data, Data):
                    tracks.add(data.track)
        received[query] = tracks
    assert received == {
        "": {0},
        "?extensions=true": {0, 1},
        "?tracks=motion&extensions=true": {0, 1},
        "?extensions=true&parts=contacts": {0, 2},
        "?extensions=false": {0},
    }
    assert described[""] == 1


@pytest.mark.parametrize(
    ("query", "sent"),
    [
        ("extensions=true", {0, 1}),
        ("extensions=true&parts=body,fingers,face", {0, 1, 2}),
        ("extensions=true&parts=fingers,tail", {0, 2}),
        ("extensions=true&parts=tail", {0}),
        ("parts=fingers", {0}),
    ],
)
async def test_parts_of_extensions_are_sent_as_requested(
    server: str, motion_with_fingers: str, query: str, sent: set[int]
) -> None:
    tracks: set[int] = set()
    async with socket(server, f"/v1/motions/{motion_with_fingers}/stream?{query}") as connection:
        while not tracks >= sent:
            if isinstance(data := await message(connection), Data):
                tracks.add(data.track)
        await connection.send(Ping(1, 2).pack())
        while not isinstance(data := await message(connection), Pong):
            if isinstance(data, Data):
                tracks.add(data.track)
    assert tracks == sent


@pytest.fixture(scope="module")
def motion_with_fingers(server: str) -> str:
    with httpx2.Client(base_url=server, timeout=HANG_TIMEOUT_S) as http:
        uploaded = http.post("/v1/motions?filename=hands.bvh", content=write_source_bvh(hand_source(45))).json()
    assert uploaded["tracks"] == ["motion", "extension", "extension"]
    assert len(uploaded["fingers"]["joints"]) == 30
    motion: str = uploaded["id"]
    return motion


async def test_http_blocks_equal_stream_blocks_and_are_immutable(server: str, motion: str) -> None:
    async with httpx2.AsyncClient(base_url=server) as http:
        block = await http.get(f"/v1/motions/{motion}/blocks/4/1")
        description = await http.get(f"/v1/motions/{motion}/description")
        assert (await http.get(f"/v1/motions/{motion}/blocks/9/0")).status_code == 404
        assert (await http.get(f"/v1/motions/{motion}/blocks/0/x")).status_code == 422
        assert (await http.get(f"/v1/motions/{motion}/blocks/4/1?track=0")).content == block.content
        absent = await http.get(f"/v1/motions/{motion}/blocks/0/0?track=1")
        assert (absent.status_code, absent.json()["field"]) == (404, "track")
        assert (await http.get(f"/v1/motions/{motion}/blocks/0/0?track=-1")).status_code == 404
        assert (await http.get("/v1/motions/none/description")).status_code == 404
    assert "immutable" in block.headers["cache-control"]
    async with socket(server, f"/v1/motions/{motion}/stream") as connection:
        received = [await connection.recv() for _ in range(5)]
    assert description.content == received[1]
    assert block.content == received[4]


async def test_pong_holds_server_times(server: str, motion: str) -> None:
    async with socket(server, f"/v1/motions/{motion}/stream") as connection:
        await connection.send(Ping(7, 123).pack())
        pong = await receive_until(connection, Pong)
        assert isinstance(pong, Pong)
        assert (pong.sequence, pong.sent) == (7, 123)
        assert pong.received <= pong.answered


async def test_edit_message_changes_own_timeline(server: str, motion: str) -> None:
    async with socket(server, f"/v1/motions/{motion}/stream?at=1.5") as connection:
        first = await receive_until(connection, TimelineState)
        assert isinstance(first, TimelineState)
        assert first.position == 1_500_000
        await connection.send(Edit(playing=False, position=200_000).pack())
        second: TimelineState | None = None
        indices: set[int] = set()
        # the first block may be sent before the edit has arrived
        while second is None or 0 not in indices:
            found = await message(connection)
            if isinstance(found, TimelineState):
                second = found
            elif isinstance(found, Data):
                indices.add(found.index)
        assert (second.epoch, second.playing, second.position) == (first.epoch + 1, False, 200_000)


async def test_unknown_messages_are_skipped(server: str, motion: str) -> None:
    async with socket(server, f"/v1/motions/{motion}/stream") as connection:
        await connection.send(b"\x7fnews")
        await connection.send(Claim(1).pack())
        await connection.send(Ping(1, 1).pack())
        assert isinstance(await receive_until(connection, Pong), Pong)


@pytest.mark.parametrize(
    ("path", "protocol", "sends", "code"),
    [
        ("/v1/motions/nothing/stream", SUBPROTOCOL, None, 4404),
        ("/v1/sessions/nothing/stream", SUBPROTOCOL, None, 4404),
        ("/v1/motions/{}/stream", "bunraku.v9", None, 4406),
        ("/v1/motions/{}/stream?tracks=smell", SUBPROTOCOL, None, 1008),
        ("/v1/motions/{}/stream", SUBPROTOCOL, bytes([64, 0]), 1008),
        ("/v1/motions/{}/stream", SUBPROTOCOL, "text", 1008),
        ("/v1/motions/{}/stream", SUBPROTOCOL, bytes([64]) + bytes(1024), 1009),
    ],
)
async def test_errors_close_stream_with_code_and_problem(
    server: str, motion: str, path: str, protocol: str, sends: bytes | str | None, code: int
) -> None:
    problem = None
    with pytest.raises(ConnectionClosed) as closed:  # noqa: PT012
        async with socket(server, path.format(motion), protocol) as connection:
            if sends is not None:
                await connection.send(sends)
            while True:
                found = await message(connection)
                problem = found if isinstance(found, Problem) else problem
    assert closed.value.rcvd is not None
    assert closed.value.rcvd.code == code
    if problem is not None:
        assert problem.title
        assert problem.detail


async def test_seek_in_paused_session_sends_block_immediately(server: str, tmp_path: Path) -> None:
    source = tmp_path / "long.bvh"
    source.write_bytes(make_bvh_clip(8.0, 31))
    async with Client(server) as client:
        session = await client.open_session((await client.upload(source))["id"], playing=False)
        async with socket(server, f"/v1/sessions/{session['id']}/stream") as connection:
            await receive_until(connection, Choice)
            await client.edit_session(session["id"], position=6_000_000)
            found = await receive_until(connection, Data)
    assert isinstance(found, Data)
    assert found.index >= 5


async def test_deleted_session_closes_its_streams_with_problem(server: str, motion: str) -> None:
    async with Client(server) as client, httpx2.AsyncClient(base_url=server) as http:
        session = (await client.open_session(motion))["id"]
        async with socket(server, f"/v1/sessions/{session}/stream") as connection:
            await receive_until(connection, Choice)
            assert (await http.delete(f"/v1/sessions/{session}")).status_code == 204
            problem = await receive_until(connection, Problem)
            assert isinstance(problem, Problem)
            assert problem.title == "Session ended"
            await connection.wait_closed()
            assert connection.close_code == 4404


async def test_paused_stage_gets_visible_blocks_at_best_level(server: str, motion: str) -> None:
    async with Client(server) as client:
        pair = (await client.add_performers(motion, [motion]))["id"]
        session = (await client.open_session(pair, playing=False))["id"]
    async with socket(server, f"/v1/sessions/{session}/stream") as connection:
        found: list[tuple[int, int, int]] = []
        while not isinstance(received := await message(connection), Choice):
            if isinstance(received, Data):
                found.append((received.track, received.index, received.rate))
        assert {(0, 0, 0), (1, 0, 0), (0, 0, 4), (1, 0, 4)} <= set(found)
        # no block follows, even after further ticks
        for sequence in (1, 2):
            await connection.send(Report(buffer=3_000_000).pack())
            await connection.send(Ping(sequence, 2).pack())
            while not isinstance(received := await message(connection), Pong):
                assert not isinstance(received, Data)
    assert len(found) == len(set(found))


async def test_paused_motion_gets_visible_block_at_best_level(server: str, motion: str) -> None:
    async with socket(server, f"/v1/motions/{motion}/stream") as connection:
        await receive_until(connection, Choice)
        await connection.send(Edit(playing=False, position=100_000).pack())
        data = await receive_until(connection, Data)
    assert isinstance(data, Data)
    assert (data.index, data.rate) == (0, 4)


async def frames_before_upgrade(server: str, address: str) -> tuple[bool, list[tuple[int, int]]]:
    """Return whether a Description is received before the first Pong, and track and index of the blocks received."""
    described, blocks = False, []
    async with socket(server, address) as connection:
        await receive_until(connection, ChannelHeader)
        await connection.send(Ping(1, 2).pack())
        while not isinstance(found := await message(connection), Pong):
            described = described or isinstance(found, Description)
            if isinstance(found, Data):
                blocks.append((found.track, found.index))
    return described, blocks


async def test_resuming_viewer_gets_only_missing_blocks(server: str, motion: str) -> None:
    async with Client(server) as client:
        pair = (await client.add_performers(motion, [motion]))["id"]
    # a motion of 3.4 s is within reach as a whole, so only the last block of the second performer is missing
    stream = f"/v1/motions/{pair}/stream?tracks=motion"
    assert await frames_before_upgrade(server, f"{stream}&have={pair}.0.444.2.0.4g-") == (False, [(1, 2)])
    assert await frames_before_upgrade(server, f"{stream}&have={pair}.0.444.2.0.4h") == (False, [])
    # a client that lists the first performer only gets all blocks of the others
    assert await frames_before_upgrade(server, f"{stream}&have={pair}.0.444.2") == (False, [(1, n) for n in range(3)])


@pytest.mark.parametrize("have", ["2.1.2G", "2.1.g", "2.1", "2" + ".1.2" * 4, "2.1." + "2z" * 32])
async def test_malformed_resume_state_is_rejected_with_problem(server: str, motion: str, have: str) -> None:
    async with socket(server, f"/v1/motions/{motion}/stream?have={motion}.0.4444.{have}") as connection:
        problem = await message(connection)
        assert isinstance(problem, Problem)
        assert problem.title == "Unreadable query"
        with pytest.raises(ConnectionClosed) as closed:
            await connection.recv()
    assert closed.value.rcvd is not None
    assert closed.value.rcvd.code == 1008


async def test_resume_state_may_exceed_motion(server: str, motion: str) -> None:
    other_performers = ".9999999.fzfzfzf" * 3
    described, blocks = await frames_before_upgrade(
        server, f"/v1/motions/{motion}/stream?have={motion}.9999999.{'f' * 64}.99{other_performers}"
    )
    assert (described, blocks) == (False, [])


@pytest.mark.parametrize("query", ["rate=99", "rate=-1", "rate=x", "at=x", "have=" + "1" * 500])
async def test_invalid_query_is_rejected_before_upgrade(server: str, motion: str, query: str) -> None:
    with pytest.raises(Exception, match=r"HTTP 4\d\d"):
        async with socket(server, f"/v1/motions/{motion}/stream?{query}") as connection:
            await connection.recv()
