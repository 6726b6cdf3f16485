"""Each service in processes of its own, two of those that may be many, upon a real nats-server."""

from __future__ import annotations

import asyncio
import sys
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from contextlib import AsyncExitStack, ExitStack, asynccontextmanager
from pathlib import Path
from typing import Any

import pytest
from websockets.asyncio.client import connect

from bunraku.client import Client, Puppeteer, Refused, ServerProblem
from bunraku.wire.messages import SUBPROTOCOL, Presence, TimelineState, unpack
from bunraku.wire.overlay import Overlay
from tests.processes import Owned, free_port, jetstream, url_of
from tests.servers import clip

PATIENCE = 20


class House:
    """The processes, and their addresses by name."""

    def __init__(self, folder: Path, nats: Owned) -> None:
        self.folder, self.nats = folder, nats
        self.processes: dict[str, Owned] = {}

    def prepare(self, name: str, *services: str) -> Owned:
        port = free_port()
        chosen = [word for service in services for word in ("--service", service)]
        data = str(self.folder / "data")
        command = [sys.executable, "-m", "bunraku.cli", "up", "--port", str(port), "--data", data, *chosen]
        (self.folder / name).mkdir()
        self.processes[name] = Owned(command, port, self.folder / name)
        return self.processes[name]

    def url(self, name: str) -> str:
        return f"http://127.0.0.1:{self.processes[name].port}"


@pytest.fixture
def house(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[House]:
    monkeypatch.setenv("NO_COLOR", "1")
    (tmp_path / "nats").mkdir()
    with ExitStack() as stack, jetstream(tmp_path / "nats") as nats:
        monkeypatch.setenv("BUNRAKU_BUS", url_of(nats))
        built = House(tmp_path, nats)
        for name, services in (
            ("ingest", ("ingest", "ik")),
            ("stream 1", ("stream",)),
            ("stream 2", ("stream",)),
            ("session 1", ("session",)),
            ("session 2", ("session",)),
        ):
            process = built.prepare(name, *services)
            stack.callback(process.stop)
            process.start()
        yield built


class Watching:
    """A viewer at one stream replica: what came, and a way to wait for more."""

    def __init__(self) -> None:
        self.messages: list[object] = []
        self._more = asyncio.Event()

    def take(self, message: object) -> None:
        self.messages.append(message)
        self._more.set()

    async def until(self, wanted: Callable[[object], bool]) -> None:
        """The first message that is wanted, from now on."""
        begin = len(self.messages)
        async with asyncio.timeout(PATIENCE):
            while not any(map(wanted, self.messages[begin:])):
                self._more.clear()
                await self._more.wait()


def pulled(message: object) -> bool:
    return isinstance(message, Overlay) and set(message.limbs) == {0}


def alone(message: object) -> bool:
    return isinstance(message, Presence) and message.limbs == [None] * 4 and not message.puppeteers


def edited_to(epoch: int) -> Callable[[object], bool]:
    return lambda message: isinstance(message, TimelineState) and message.epoch >= epoch


@asynccontextmanager
async def watching(url: str, session: str) -> AsyncIterator[Watching]:
    viewer = Watching()
    address = url.replace("http", "ws") + f"/v1/sessions/{session}/stream?rate=0"
    async with connect(address, subprotocols=[SUBPROTOCOL], compression=None) as socket:  # type: ignore[list-item]

        async def read() -> None:
            async for data in socket:
                assert isinstance(data, bytes)
                viewer.take(unpack(data))

        reading = asyncio.create_task(read())
        try:
            await viewer.until(lambda message: isinstance(message, Presence))
            yield viewer
        finally:
            reading.cancel()
            await asyncio.wait((reading,))


async def pulling(stack: AsyncExitStack, client: Client, session: str) -> Puppeteer:
    """A puppeteer who holds the left hand, as soon as there is a stage for it."""
    async with asyncio.timeout(PATIENCE):
        while True:
            try:
                puppeteer = await stack.enter_async_context(Puppeteer(client, session, "Aiko"))
                await puppeteer.claim("left_hand")
                await puppeteer.target("left_hand", 0.4, 0.1, 0.4)
            except Refused:
                # between two owners the door says: come again
                await asyncio.sleep(0.1)
            else:
                return puppeteer


async def asked_again(ask: Callable[[], Awaitable[dict[str, Any]]]) -> dict[str, Any]:
    """The answer, once there is one: until then the server says that it cannot now, and to try again."""
    async with asyncio.timeout(PATIENCE):
        while True:
            try:
                return await ask()
            except ServerProblem as problem:
                if problem.status != 503:
                    raise
                await asyncio.sleep(0.1)


async def test_a_session_is_pulled_through_any_replica_and_survives_its_own(house: House) -> None:
    source = house.folder / "one.bvh"
    source.write_bytes(clip(4.0, 1))
    async with AsyncExitStack() as stack:
        ingest, one, two = [
            await stack.enter_async_context(Client(house.url(name))) for name in ("ingest", "session 1", "session 2")
        ]
        motion = (await ingest.upload(source))["id"]
        session = (await one.open_session(motion))["id"]
        assert await two.first_session() == session
        near, far = [
            await stack.enter_async_context(watching(house.url(name), session)) for name in ("stream 1", "stream 2")
        ]
        waiting = [asyncio.create_task(viewer.until(edited_to(2))) for viewer in (near, far)]
        edited = await two.edit_session(session, position=1_000_000, loop=True)
        assert edited["epoch"] == 2
        await asyncio.gather(*waiting)
        await pulling(stack, two, session)
        for viewer in (near, far):
            await viewer.until(pulled)
        # its owner dies, and is not there any more to say so
        waiting = [asyncio.create_task(viewer.until(alone)) for viewer in (near, far)]
        await asyncio.to_thread(house.processes["session 1"].kill)
        await asyncio.gather(*waiting)
        puppeteer = await pulling(stack, two, session)
        for viewer in (near, far):
            await viewer.until(pulled)
        described = await two.session(session)
        assert (described["epoch"], described["motion"]) == (2, motion)
        assert described["limbs"] == [puppeteer.id, None, None, None]
        async with asyncio.timeout(PATIENCE):
            while (await two.session(session))["viewers"] != 2:  # noqa: ASYNC110
                await asyncio.sleep(0.05)
        # one that ends in order hands its sessions on
        third = house.prepare("session 3", "session")
        stack.callback(third.stop)
        await asyncio.to_thread(third.start)
        waiting = [asyncio.create_task(viewer.until(alone)) for viewer in (near, far)]
        await asyncio.to_thread(house.processes["session 2"].stop)
        await asyncio.gather(*waiting)
        three = await stack.enter_async_context(Client(house.url("session 3")))
        assert (await asked_again(lambda: three.session(session)))["epoch"] == 2
        # the broker goes away and comes back: an edit is refused meanwhile, and once it is taken everyone has it
        await asyncio.to_thread(house.nats.kill)
        with pytest.raises(ServerProblem, match="the bus does not answer"):
            await three.edit_session(session, playing=False)
        waiting = [asyncio.create_task(viewer.until(edited_to(3))) for viewer in (near, far)]
        await asyncio.to_thread(house.nats.start)
        await asked_again(lambda: three.edit_session(session, playing=False))
        await asyncio.gather(*waiting)
