"""Services in separate processes on a real nats-server, with two replicas of stream and session."""

from __future__ import annotations

import asyncio
import json
import math
import sys
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Iterator
from contextlib import AsyncExitStack, ExitStack, asynccontextmanager
from pathlib import Path
from typing import Any

import pytest
from websockets.asyncio.client import connect

from bunraku.client import Client, ControlRefused, Puppeteer, ServerProblem
from bunraku.wire.live import Live
from bunraku.wire.messages import SUBPROTOCOL, Presence, TimelineState, unpack
from bunraku.wire.overlay import Overlay
from tests.processes import ServerProcess, free_port, nats_url_of, run_jetstream
from tests.servers import make_bvh_clip
from tests.time_limit import HANG_TIMEOUT_S


class Deployment:
    """Service processes and their addresses by name."""

    def __init__(self, folder: Path, nats: ServerProcess) -> None:
        self.folder, self.nats = folder, nats
        self.processes: dict[str, ServerProcess] = {}

    def add_process(self, name: str, *services: str) -> ServerProcess:
        port = free_port()
        service_options = [word for service in services for word in ("--service", service)]
        data = str(self.folder / "data")
        command = [sys.executable, "-m", "bunraku.cli", "up", "--port", str(port), "--data", data, *service_options]
        (self.folder / name).mkdir()
        self.processes[name] = ServerProcess(command, port, self.folder / name)
        return self.processes[name]

    def url(self, name: str) -> str:
        return f"http://127.0.0.1:{self.processes[name].port}"


@pytest.fixture
def deployment(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Deployment]:
    monkeypatch.setenv("NO_COLOR", "1")
    (tmp_path / "nats").mkdir()
    with ExitStack() as stack, run_jetstream(tmp_path / "nats") as nats:
        monkeypatch.setenv("BUNRAKU_BUS", nats_url_of(nats))
        deployed = Deployment(tmp_path, nats)
        for name, services in (
            ("ingest", ("ingest", "ik")),
            ("stream 1", ("stream",)),
            ("stream 2", ("stream",)),
            ("session 1", ("session",)),
            ("session 2", ("session",)),
        ):
            process = deployed.add_process(name, *services)
            stack.callback(process.stop)
            process.start()
        yield deployed


class RecordingViewer:
    """Viewer at one stream replica: the received messages, and a way to wait for more."""

    def __init__(self) -> None:
        self.messages: list[object] = []
        self._changed = asyncio.Event()

    def add_message(self, message: object) -> None:
        self.messages.append(message)
        self._changed.set()

    async def wait_for(self, matches: Callable[[object], bool]) -> None:
        """Wait for the next message for which `matches` returns true."""
        begin = len(self.messages)
        async with asyncio.timeout(HANG_TIMEOUT_S):
            while not any(map(matches, self.messages[begin:])):
                self._changed.clear()
                await self._changed.wait()


def is_left_hand_overlay(message: object) -> bool:
    return isinstance(message, Overlay) and set(message.limbs) == {0}


def is_empty_presence(message: object) -> bool:
    return isinstance(message, Presence) and message.limbs == [None] * 4 and not message.puppeteers


def is_timeline_since(epoch: int) -> Callable[[object], bool]:
    return lambda message: isinstance(message, TimelineState) and message.epoch >= epoch


@asynccontextmanager
async def watch_session(url: str, session: str) -> AsyncIterator[RecordingViewer]:
    viewer = RecordingViewer()
    address = url.replace("http", "ws") + f"/v1/sessions/{session}/stream?rate=0"
    async with connect(address, subprotocols=[SUBPROTOCOL], compression=None) as socket:  # type: ignore[list-item]

        async def read() -> None:
            async for data in socket:
                assert isinstance(data, bytes)
                viewer.add_message(unpack(data))

        reading = asyncio.create_task(read())
        try:
            await viewer.wait_for(lambda message: isinstance(message, Presence))
            yield viewer
        finally:
            reading.cancel()
            await asyncio.wait((reading,))


async def open_puppeteer(stack: AsyncExitStack, client: Client, session: str) -> Puppeteer:
    """Connect a puppeteer and claim the left hand; retry while the session has no owner."""
    async with asyncio.timeout(HANG_TIMEOUT_S):
        while True:
            try:
                puppeteer = await stack.enter_async_context(Puppeteer(client, session, "Aiko"))
                await puppeteer.claim("left_hand")
                await puppeteer.target("left_hand", 0.4, 0.1, 0.4)
            except ControlRefused:
                # while no replica owns the session, clients are asked to retry
                await asyncio.sleep(0.1)
            else:
                return puppeteer


async def retry_until_available(request: Callable[[], Awaitable[dict[str, Any]]]) -> dict[str, Any]:
    """Return the response of `request`; retry while it is rejected with 503."""
    async with asyncio.timeout(HANG_TIMEOUT_S):
        while True:
            try:
                return await request()
            except ServerProblem as problem:
                if problem.status != 503:
                    raise
                await asyncio.sleep(0.1)


async def test_session_is_controlled_through_any_replica_and_outlives_its_owner(deployment: Deployment) -> None:
    source = deployment.folder / "one.bvh"
    source.write_bytes(make_bvh_clip(4.0, 1))
    async with AsyncExitStack() as stack:
        ingest, one, two = [
            await stack.enter_async_context(Client(deployment.url(name)))
            for name in ("ingest", "session 1", "session 2")
        ]
        motion = (await ingest.upload(source))["id"]
        session = (await one.open_session(motion))["id"]
        assert await two.first_session() == session
        near, far = [
            await stack.enter_async_context(watch_session(deployment.url(name), session))
            for name in ("stream 1", "stream 2")
        ]
        waiting = [asyncio.create_task(viewer.wait_for(is_timeline_since(2))) for viewer in (near, far)]
        edited = await two.edit_session(session, position=1_000_000, loop=True)
        assert edited["epoch"] == 2
        await asyncio.gather(*waiting)
        await open_puppeteer(stack, two, session)
        for viewer in (near, far):
            await viewer.wait_for(is_left_hand_overlay)
        # the owner is killed and cannot announce it
        waiting = [asyncio.create_task(viewer.wait_for(is_empty_presence)) for viewer in (near, far)]
        await asyncio.to_thread(deployment.processes["session 1"].kill)
        await asyncio.gather(*waiting)
        puppeteer = await open_puppeteer(stack, two, session)
        for viewer in (near, far):
            await viewer.wait_for(is_left_hand_overlay)
        described = await two.session(session)
        assert (described["epoch"], described["motion"]) == (2, motion)
        assert described["limbs"] == [puppeteer.id, None, None, None]
        async with asyncio.timeout(HANG_TIMEOUT_S):
            while (await two.session(session))["viewers"] != 2:  # noqa: ASYNC110
                await asyncio.sleep(0.05)
        # a replica that shuts down in order hands its sessions over
        third = deployment.add_process("session 3", "session")
        stack.callback(third.stop)
        await asyncio.to_thread(third.start)
        waiting = [asyncio.create_task(viewer.wait_for(is_empty_presence)) for viewer in (near, far)]
        await asyncio.to_thread(deployment.processes["session 2"].stop)
        await asyncio.gather(*waiting)
        three = await stack.enter_async_context(Client(deployment.url("session 3")))
        assert (await retry_until_available(lambda: three.session(session)))["epoch"] == 2
        # while the broker is unavailable an edit is rejected; the edit accepted afterwards reaches every viewer
        await asyncio.to_thread(deployment.nats.kill)
        with pytest.raises(ServerProblem, match="the bus is unavailable"):
            await three.edit_session(session, playing=False)
        waiting = [asyncio.create_task(viewer.wait_for(is_timeline_since(3))) for viewer in (near, far)]
        await asyncio.to_thread(deployment.nats.start)
        await retry_until_available(lambda: three.edit_session(session, playing=False))
        await asyncio.gather(*waiting)


async def test_live_performer_goes_on_when_the_owner_of_its_session_is_killed(deployment: Deployment) -> None:
    urls = {name: deployment.url(name) for name in deployment.processes}

    async def is_shown(viewer: RecordingViewer, performer: int) -> None:
        await viewer.wait_for(lambda message: isinstance(message, Live) and performer in message.blocks)

    async with AsyncExitStack() as stack:
        first, second, ingest = [
            await stack.enter_async_context(Client(urls[name])) for name in ("session 1", "session 2", "ingest")
        ]
        # the stage is at the first replica; the performer is connected to the second
        performer = await first.create_performer({"name": "Aiko"})
        session = performer["session"]
        address = second.socket_url(performer["input"])
        socket = await stack.enter_async_context(connect(address, subprotocols=[SUBPROTOCOL], compression=None))  # type: ignore[list-item]

        async def send_samples() -> None:
            while True:
                await socket.send(json.dumps({"root": [0.0, 0.8 + 0.1 * math.sin(time.monotonic()), 0.0]}))
                await asyncio.sleep(1 / 60)

        sending = asyncio.create_task(send_samples())
        stack.callback(sending.cancel)
        viewer = await stack.enter_async_context(watch_session(urls["stream 1"], session))
        await is_shown(viewer, 0)
        deployment.processes["session 1"].kill()
        await viewer.wait_for(lambda message: isinstance(message, Presence) and bool(message.live))
        await is_shown(viewer, 0)
        assert (await second.performer(performer["id"]))["name"] == "Aiko"
        sending.cancel()
        await second.end_performer(performer["id"])
        async with asyncio.timeout(HANG_TIMEOUT_S):
            while performer["motion"] not in [motion["id"] for motion in await ingest.motions()]:  # noqa: ASYNC110
                await asyncio.sleep(0.1)
