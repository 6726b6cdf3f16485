"""Viewers: the receiver of the Python SDK, on a simulated connection to a real `ViewerConnection`."""

from __future__ import annotations

import asyncio
from functools import partial
from random import Random
from urllib.parse import parse_qs, urlsplit

from bunraku.client.reconnecting_connection import RETRY_INTERVAL_S, SILENCE_TIMEOUT_S
from bunraku.client.viewer import Viewer
from bunraku.delivery.resume import ResumeState
from bunraku.messaging.bus import NoResponse
from bunraku.messaging.key_value import SESSION_KEY_PREFIX
from bunraku.runtime.availability import BackendUnavailable
from bunraku.stream.track_selection import ViewerOptions
from bunraku.stream.viewer_connection import ViewerConnection
from bunraku.websocket.connection import WebSocketConnection
from bunraku.websocket.frame import Opcode
from bunraku.websocket.subprotocol import CloseConnection
from tests.simulation.link import LinkQuality
from tests.simulation.node import Node
from tests.simulation.replica import StreamReplica
from tests.simulation.transport import ServerTransport, encode_client_frame
from tests.stream.fake_transport import parse_frames

MAX_ACCEPT_US = 2_000
"""Longest time in which a server accepts a WebSocket."""


async def watch_session(
    replica: StreamReplica, transport: ServerTransport, session: str, query: dict[str, list[str]], is_measured: bool
) -> bool:
    """Serve a viewer as the stream service does; return False if there is no such session."""
    accept_s = transport.random.randrange(MAX_ACCEPT_US) * 1e-6
    have = query.get("have", [""])[0]
    viewer = ViewerConnection(replica.stream, ViewerOptions(resume_state=ResumeState.parse(have) if have else None))
    try:
        async with replica.watched.open(session) as watched:
            await asyncio.sleep(accept_s)
            if transport.is_closing():
                # the client left during the handshake
                return True
            connection = WebSocketConnection(transport, viewer, replica.connections, replica.context.clock)
            replica.stream.counters.count_writes(connection)
            watched.add_viewer(viewer)
            viewer.open(connection, transport if is_measured else None)
            connection.on_ended = replica.stream.counters.add_viewer(viewer, "session", lambda: None)
            if watched.close_reason is not None:
                viewer.disconnect(watched.close_reason)
    except NoResponse:
        exists = await replica.context.key_values.get(f"{SESSION_KEY_PREFIX}.{session}") is not None
        transport.abort()
        return exists
    return True


class SimulatedViewer:
    """Viewer of a session that reconnects whenever its connection ends or is silent."""

    def __init__(
        self, node: Node, random: Random, replicas: list[StreamReplica], session: str, quality: LinkQuality
    ) -> None:
        self.node = node
        self.session = session
        self.transport: ServerTransport | None = None
        self.replica: StreamReplica | None = None
        self.is_done = False
        """True if the session has ended or the viewer has left."""
        self._random = random
        self._replicas = replicas
        self._quality = quality
        self._is_measured = random.random() < 0.5
        self._received_us = 0
        self._is_fresh = True
        self._lost = asyncio.Event()
        self.viewer = Viewer(f"ws://server/v1/sessions/{session}/stream", local_clock=node.clock)
        self.viewer._reporter._send = self._send
        self._task = node.start(self._run(), f"viewer {node.name}")

    @property
    def is_connected(self) -> bool:
        """True if messages arrive."""
        return self.transport is not None and self.viewer.timeline_history.newest is not None

    async def leave(self) -> None:
        """Disconnect for good."""
        self.is_done = True
        self._task.cancel()
        await asyncio.wait((self._task,))

    async def _run(self) -> None:
        reporter = asyncio.create_task(self.viewer._reporter.run(), name="reporter")
        try:
            while not self.is_done:
                await self._connect()
                await asyncio.sleep(RETRY_INTERVAL_S)
        finally:
            if self.transport is not None:
                self.transport.close_from_client()
                self.transport = None
            reporter.cancel()
            await asyncio.wait((reporter,))

    async def _connect(self) -> None:
        """Keep one connection until it ends or is silent."""
        reachable = [replica for replica in self._replicas if replica.is_up]
        if not reachable:
            return
        replica = self.replica = self._random.choice(reachable)
        transport = ServerTransport(replica.node, self.node, self._random, self._quality)
        self._lost.clear()
        transport.on_data, transport.on_lost = partial(self._on_data, transport), self._lost.set
        parts = urlsplit(self.viewer._make_url())
        query = parse_qs(parts.query)

        async def accept() -> None:
            try:
                found = await watch_session(replica, transport, self.session, query, self._is_measured)
            except (CloseConnection, BackendUnavailable):
                transport.abort()
            else:
                if not found:
                    self.is_done = True

        transport.uplink.send(lambda: replica.node.start(accept(), "watch session"))
        self._received_us = self.node.clock()
        self._is_fresh = True
        self.transport = transport
        while not self._lost.is_set():
            silence = (self.node.clock() - self._received_us) * 1e-6
            if silence >= SILENCE_TIMEOUT_S:
                break
            try:
                async with asyncio.timeout(SILENCE_TIMEOUT_S - silence):
                    await self._lost.wait()
            except TimeoutError:
                continue
        self.transport = None
        transport.close_from_client()

    def _on_data(self, transport: ServerTransport, data: bytes) -> None:
        self._received_us = self.node.clock()
        if self._is_fresh:
            self._is_fresh = False
            self.viewer._on_open()
        # the server writes whole frames
        for opcode, payload in parse_frames(data):
            if opcode == Opcode.BINARY:
                self.viewer._on_bytes(payload)
            elif opcode in (Opcode.PING, Opcode.CLOSE):
                answer = Opcode.PONG if opcode == Opcode.PING else Opcode.CLOSE
                transport.send_to_server(encode_client_frame(payload, answer))

    async def _send(self, message: bytes) -> None:
        # the connection is open once the first message has arrived
        if self.transport is not None and not self._is_fresh:
            self.transport.send_to_server(encode_client_frame(message))
