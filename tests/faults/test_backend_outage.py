"""All services on PostgreSQL, S3 and NATS, and what still works while these backends are unavailable."""

from __future__ import annotations

import asyncio
import itertools
import math
import secrets
from collections.abc import Awaitable, Iterator
from contextlib import ExitStack
from pathlib import Path

import asyncpg
import httpx2
import pytest

from bunraku.client import Client, Puppeteer, ServerProblem, Viewer
from tests.patient_viewer import watch_until
from tests.processes import ServerProcess, nats_url_of, run_jetstream, run_postgres, run_s3_server
from tests.servers import make_bvh_clip, run_server
from tests.time_limit import HANG_TIMEOUT_S


class Deployment:
    """Running server and its backends."""

    def __init__(self, url: str, database: ServerProcess, bus: ServerProcess) -> None:
        self.url, self.database, self.bus = url, database, bus


@pytest.fixture(scope="module")
def deployment(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Deployment]:
    with ExitStack() as stack:
        patch = stack.enter_context(pytest.MonkeyPatch.context())
        folders = [tmp_path_factory.mktemp(name) for name in ("nats", "s3", "data")]
        database = stack.enter_context(run_postgres())
        bus = stack.enter_context(run_jetstream(folders[0]))
        store = stack.enter_context(run_s3_server(folders[1]))
        endpoint = f"http://127.0.0.1:{store.port}"
        patch.setenv("AWS_ENDPOINT_URL", endpoint)
        patch.setenv("AWS_REGION", "us-east-1")
        patch.setenv("AWS_ACCESS_KEY_ID", "key")
        patch.setenv("AWS_SECRET_ACCESS_KEY", "secret")
        httpx2.put(f"{endpoint}/bunraku").raise_for_status()
        url = stack.enter_context(
            run_server(
                folders[2],
                catalogue=f"postgresql://postgres@127.0.0.1:{database.port}/postgres",
                library="s3://bunraku/motions",
                bus=nats_url_of(bus),
            )
        )
        yield Deployment(url, database, bus)


def write_clip(folder: Path, seconds: float = 2.0) -> Path:
    source = folder / "dance.bvh"
    source.write_bytes(make_bvh_clip(seconds, secrets.randbelow(10_000)))
    return source


async def response_status(request: Awaitable[object]) -> int:
    """Return the status of the response to a request."""
    try:
        await request
    except ServerProblem as problem:
        return problem.status
    return 200


async def move_hand(puppeteer: Puppeteer) -> None:
    """Move the left hand to and fro."""
    for number in itertools.count():
        await puppeteer.target("left_hand", 0.7, 0.5 + 0.3 * math.sin(number / 15), 0.4)
        await asyncio.sleep(1 / 60)


async def test_motion_is_uploaded_controlled_and_recorded_on_real_backends(
    deployment: Deployment, tmp_path: Path
) -> None:
    async with Client(deployment.url) as client:
        motion = await client.upload(write_clip(tmp_path))
        session = (await client.open_session(motion["id"]))["id"]
        viewer = Viewer(client.socket_url(f"/v1/sessions/{session}/stream"))
        async with Puppeteer(client, session) as puppeteer:
            await puppeteer.claim("left_hand")
            moving = asyncio.create_task(move_hand(puppeteer))
            # a second of motion after the first overlays
            await watch_until(viewer, lambda: viewer.statistics.overlays > 40)
            moving.cancel()
        assert viewer.statistics.gaps == 0
        recording = await client.record(session, "kept", 1.0)
        assert (await client.motion(recording["id"]))["kept_from"] == motion["id"]
    connection = await asyncpg.connect(f"postgresql://postgres@127.0.0.1:{deployment.database.port}/postgres")
    assert await connection.fetchval("SELECT count(*) FROM motions") >= 2
    await connection.close()


async def test_playback_continues_while_catalogue_and_bus_are_unavailable(
    deployment: Deployment, tmp_path: Path
) -> None:
    async with Client(deployment.url) as client:
        motion = await client.upload(write_clip(tmp_path, 5.0))
        session = (await client.open_session(motion["id"]))["id"]
        viewer = Viewer(client.socket_url(f"/v1/sessions/{session}/stream"))
        shown = asyncio.Event()
        watching = asyncio.create_task(viewer.watch(2 * HANG_TIMEOUT_S, lambda _, __: shown.set()))
        async with asyncio.timeout(HANG_TIMEOUT_S):
            await shown.wait()
        deployment.database.kill()
        deployment.bus.kill()
        for request in (client.motions(), client.motion(motion["id"]), client.upload(write_clip(tmp_path))):
            assert await response_status(request) == 503
        deployment.database.start()
        deployment.bus.start()
        async with asyncio.timeout(HANG_TIMEOUT_S):
            while (status := await response_status(client.upload(write_clip(tmp_path)))) != 200:
                assert status == 503
            # for longer than the motion
            while viewer.statistics.frames <= 360:
                assert not watching.done()
                await asyncio.sleep(0.01)
        watching.cancel()
        await asyncio.gather(watching, return_exceptions=True)
        assert viewer.statistics.gaps == 0
