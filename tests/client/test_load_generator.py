from __future__ import annotations

import asyncio
import resource
from pathlib import Path

import pytest

from bunraku.client import Client
from bunraku.client.load_generator import FileLimitExceeded, LoadGenerator, run_load
from tests.e2e.test_live import sending
from tests.time_limit import HANG_TIMEOUT_S


async def test_all_of_them_are_sent_the_dance(server: str, clip_file: Path) -> None:
    told: list[tuple[str, float]] = []
    async with Client(server) as client:
        motion = (await client.upload(clip_file))["id"]
        session = await client.open_session(motion)
        url = client.socket_url(f"/v1/sessions/{session['id']}/stream")
        assert await client.first_session() is not None
    figures = await run_load(url, 12, 0.5, on_progress=lambda stage, share: told.append((stage, share)))
    assert (figures.viewers, figures.joined, figures.refused, figures.dropped) == (12, 12, 0, 0)
    assert figures.why is None
    assert figures.join_ms_p99 is not None
    assert {stage for stage, _ in told} == {"joining", "watching"}
    assert all(0 <= share <= 1 for _, share in told)
    assert figures.as_json()["stalls"] == 0


async def test_blocks_are_counted_once_each_and_are_in_time(server: str, clip_file: Path) -> None:
    async with Client(server) as client:
        motion = (await client.upload(clip_file))["id"]
        url = client.socket_url(f"/v1/motions/{motion}/stream")
    crowd = LoadGenerator(url)
    crowd.reset_statistics()
    await crowd.join(4)
    figures = await run_load(url, 2, 0.3)
    held = [len(viewer._received_blocks) for viewer in crowd.viewers]
    blocks = len(crowd.state.block_lateness)
    stalls = crowd.state.stalls
    await crowd.close()
    assert figures.joined == 2
    assert all(number >= 1 for number in held)
    # but for the first of each, which has begun when one comes
    assert blocks == sum(held) - 4
    assert stalls == 0


async def test_live_messages_and_the_gaps_between_them_are_counted(server: str) -> None:
    async with Client(server) as client, client.perform() as performer, sending(performer):
        crowd = LoadGenerator(client.socket_url(f"/v1/sessions/{performer.session}/stream"))
        await crowd.join(2)
        async with asyncio.timeout(HANG_TIMEOUT_S):
            while len(crowd.state.live_gaps) < 20:  # noqa: ASYNC110
                await asyncio.sleep(0.01)
        figures = crowd.statistics()
        await crowd.close()
    # the first message of each viewer has none before it
    assert figures.live_messages == len(crowd.state.live_gaps) + 2
    assert figures.live_gap_ms_p99 is not None
    assert figures.live_gap_ms_p99 > 0
    assert figures.overlays == 0


async def test_what_is_refused_is_counted_and_said(server: str) -> None:
    figures = await run_load(f"{server.replace('http', 'ws')}/v1/sessions/none/stream", 3, 0.1)
    assert figures.joined - figures.dropped == 0
    assert "No such session" in str(figures.why)
    figures = await run_load("ws://127.0.0.1:9/v1/sessions/none/stream", 3, 0.1)
    assert (figures.joined, figures.refused) == (0, 3)
    assert figures.why


async def test_more_than_the_system_allows_is_said_before_anything_is_opened() -> None:
    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    if hard == resource.RLIM_INFINITY:
        pytest.skip("this system lets a process open as many files as it likes")
    with pytest.raises(FileLimitExceeded, match=str(hard)):
        await run_load("ws://127.0.0.1:9/", hard, 1.0)
    assert resource.getrlimit(resource.RLIMIT_NOFILE) == (soft, hard)
