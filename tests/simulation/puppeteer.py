"""Puppeteers: clients that claim, move and release limbs through any replica of the session service."""

from __future__ import annotations

import asyncio
from contextlib import ExitStack
from functools import partial
from random import Random

from bunraku.runtime.availability import BackendUnavailable
from bunraku.runtime.problem import ProblemError
from bunraku.session.puppeteer_connection import PUPPETEER_FRAMES, PuppeteerConnection
from bunraku.websocket.connection import WebSocketConnection
from bunraku.websocket.frame import Opcode
from bunraku.wire.messages import Alive, Ask, Claim, Grant, Input, Presence, Refusal, Release, Welcome, unpack
from tests.simulation.link import GOOD_LINK
from tests.simulation.node import Node
from tests.simulation.replica import SessionReplica
from tests.simulation.transport import ServerTransport, encode_client_frame
from tests.stream.fake_transport import parse_frames

RETRY_INTERVAL_S = 0.3
INPUT_INTERVAL_S = 0.1
"""Interval of inputs or keep-alive messages while a limb is held."""


async def control_session(replica: SessionReplica, transport: ServerTransport, session: str, name: str) -> None:
    """Serve a puppeteer as the control endpoint of the session service does."""
    stage = replica.sessions.stage_proxy(session)
    connection = PuppeteerConnection(stage, replica.sessions.counters, replica.context.clock)
    try:
        with ExitStack() as stack:
            stack.callback(
                replica.context.bus.subscribe(stage.outgoing_subject(connection), connection.send).unsubscribe
            )
            await stage.join(connection, name)
            stack.callback(stage.send, connection, None)
            if transport.is_closing():
                # the client left during the handshake
                return
            accepted = WebSocketConnection(
                transport, connection, replica.connections, replica.context.clock, PUPPETEER_FRAMES
            )
            accepted.on_ended = stack.pop_all().close
        connection.open(accepted)
    except (ProblemError, BackendUnavailable):
        transport.abort()


class SimulatedPuppeteer:
    """Puppeteer who reconnects whenever the connection ends."""

    def __init__(self, node: Node, random: Random, replicas: list[SessionReplica], session: str) -> None:
        self.node = node
        self.session = session
        self.id: str | None = None
        self.epochs: dict[int, int] = {}
        """Epochs of the limbs that the puppeteer believes to hold."""
        self.presence: Presence | None = None
        self.is_moving = True
        self._transport: ServerTransport | None = None
        self._random = random
        self._replicas = replicas
        self._sequence = 0
        self._lost = asyncio.Event()
        self._task = node.start(self._run(), f"puppeteer {node.name}")

    def claim(self, limb: int) -> None:
        """Ask for a free limb."""
        self._send(Claim(limb).pack())

    def ask(self, limb: int, wanted: bool) -> None:
        """Ask the holder of a limb for it, or no longer."""
        self._send(Ask(limb, wanted).pack())

    def release(self, limb: int) -> None:
        """Release a limb."""
        if limb in self.epochs:
            self._send(Release(limb, self.epochs.pop(limb)).pack())

    async def leave(self) -> None:
        """Disconnect for good."""
        self._task.cancel()
        await asyncio.wait((self._task,))

    def _on_data(self, transport: ServerTransport, data: bytes) -> None:
        for opcode, payload in parse_frames(data):
            if opcode == Opcode.BINARY:
                self._on_message(payload)
            elif opcode in (Opcode.PING, Opcode.CLOSE):
                answer = Opcode.PONG if opcode == Opcode.PING else Opcode.CLOSE
                transport.send_to_server(encode_client_frame(payload, answer))

    def _on_message(self, data: bytes) -> None:
        message = unpack(data)
        if isinstance(message, Welcome):
            self.id = message.id
        elif isinstance(message, Grant):
            self.epochs[message.limb] = message.epoch
        elif isinstance(message, Refusal):
            self.epochs.pop(message.limb, None)
        elif isinstance(message, Presence):
            self.presence = message

    def _send(self, message: bytes) -> None:
        if self._transport is not None and self.id is not None:
            self._transport.send_to_server(encode_client_frame(message))

    async def _run(self) -> None:
        inputs = asyncio.create_task(self._send_inputs(), name="inputs")
        try:
            while True:
                reachable = [replica for replica in self._replicas if replica.is_up]
                if reachable:
                    await self._connect(self._random.choice(reachable))
                await asyncio.sleep(RETRY_INTERVAL_S)
        finally:
            self._forget_connection()
            inputs.cancel()
            await asyncio.wait((inputs,))

    async def _connect(self, replica: SessionReplica) -> None:
        """Keep one connection until it ends."""
        transport = self._transport = ServerTransport(replica.node, self.node, self._random, GOOD_LINK)
        self._lost.clear()
        transport.on_data, transport.on_lost = partial(self._on_data, transport), self._lost.set
        serve = partial(control_session, replica, transport, self.session, self.node.name)
        transport.uplink.send(lambda: replica.node.start(serve(), "puppeteer"))
        await self._lost.wait()
        self._forget_connection()

    def _forget_connection(self) -> None:
        if self._transport is not None:
            self._transport.close_from_client()
        self._transport = self.id = self.presence = None
        self.epochs.clear()

    async def _send_inputs(self) -> None:
        random = self._random
        while True:
            await asyncio.sleep(INPUT_INTERVAL_S)
            for limb, epoch in self.epochs.items():
                if self.is_moving:
                    self._sequence += 1
                    values = (random.uniform(-0.5, 0.5), random.uniform(-0.5, 0.5), random.uniform(0.2, 0.6))
                    self._send(Input(limb, Input.TARGET, epoch, self._sequence, self.node.clock(), values).pack())
            if self.epochs and not self.is_moving:
                self._send(Alive(list(self.epochs)).pack())
