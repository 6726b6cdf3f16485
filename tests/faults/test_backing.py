"""The whole house upon PostgreSQL, S3 and NATS, and what still goes on while they are away."""

from __future__ import annotations

import asyncio
import secrets
from collections.abc import Awaitable, Iterator
from contextlib import ExitStack
from pathlib import Path

import asyncpg
import httpx2
import pytest

from bunraku.client import Client, Puppeteer, ServerProblem, Viewer
from tests.processes import Owned, jetstream, postgres, s3_server, url_of
from tests.servers import clip, running


class House:
    """A running server and what it stands on."""

    def __init__(self, url: str, database: Owned, bus: Owned) -> None:
        self.url, self.database, self.bus = url, database, bus


@pytest.fixture(scope="module")
def house(tmp_path_factory: pytest.TempPathFactory) -> Iterator[House]:
    with ExitStack() as stack:
        patch = stack.enter_context(pytest.MonkeyPatch.context())
        folders = [tmp_path_factory.mktemp(name) for name in ("nats", "s3", "data")]
        database = stack.enter_context(postgres())
        bus = stack.enter_context(jetstream(folders[0]))
        store = stack.enter_context(s3_server(folders[1]))
        endpoint = f"http://127.0.0.1:{store.port}"
        patch.setenv("AWS_ENDPOINT_URL", endpoint)
        patch.setenv("AWS_REGION", "us-east-1")
        patch.setenv("AWS_ACCESS_KEY_ID", "key")
        patch.setenv("AWS_SECRET_ACCESS_KEY", "secret")
        httpx2.put(f"{endpoint}/bunraku").raise_for_status()
        url = stack.enter_context(
            running(
                folders[2],
                catalogue=f"postgresql://postgres@127.0.0.1:{database.port}/postgres",
                library="s3://bunraku/motions",
                bus=url_of(bus),
            )
        )
        yield House(url, database, bus)


def dance(folder: Path, seconds: float = 2.0) -> Path:
    source = folder / "dance.bvh"
    source.write_bytes(clip(seconds, secrets.randbelow(10_000)))
    return source


async def status(asked: Awaitable[object]) -> int:
    """What the server says of a request."""
    try:
        await asked
    except ServerProblem as problem:
        return problem.status
    return 200


async def test_a_dance_is_taken_in_pulled_at_and_kept(house: House, tmp_path: Path) -> None:
    async with Client(house.url) as client:
        motion = await client.upload(dance(tmp_path))
        session = (await client.open_session(motion["id"]))["id"]
        viewer = Viewer(client.socket_url(f"/v1/sessions/{session}/stream"))
        watching = asyncio.create_task(viewer.watch(2.0))
        async with Puppeteer(client, session) as puppeteer:
            await puppeteer.claim("left_hand")
            for number in range(60):
                await puppeteer.target("left_hand", 0.7, 0.2 + 0.01 * number, 0.4)
                await asyncio.sleep(1 / 60)
        figures = await watching
        assert figures.overlays > 10
        assert figures.gaps == 0
        kept = await client.keep(session, "kept", 1.0)
        assert (await client.motion(kept["id"]))["kept_from"] == motion["id"]
    connection = await asyncpg.connect(f"postgresql://postgres@127.0.0.1:{house.database.port}/postgres")
    assert await connection.fetchval("SELECT count(*) FROM motions") >= 2
    await connection.close()


async def test_the_dance_plays_on_while_catalogue_and_bus_are_away(house: House, tmp_path: Path) -> None:
    async with Client(house.url) as client:
        motion = await client.upload(dance(tmp_path, 5.0))
        session = (await client.open_session(motion["id"]))["id"]
        viewer = Viewer(client.socket_url(f"/v1/sessions/{session}/stream"))
        shown = asyncio.Event()
        watching = asyncio.create_task(viewer.watch(6.0, lambda _, __: shown.set()))
        async with asyncio.timeout(60):
            await shown.wait()
        house.database.kill()
        house.bus.kill()
        for asked in (client.motions(), client.motion(motion["id"]), client.upload(dance(tmp_path))):
            assert await status(asked) == 503
        house.database.start()
        house.bus.start()
        async with asyncio.timeout(60):
            while (said := await status(client.upload(dance(tmp_path)))) != 200:
                assert said == 503
        figures = await watching
        assert figures.gaps == 0
        assert figures.frames > 100
