"""Live performer of the Python SDK: brings a figure on a stage and sends its poses."""

from __future__ import annotations

import asyncio
import contextlib
import time
from collections.abc import Mapping
from typing import Any, Protocol, Self

import httpx2

from bunraku.client.authorization import authorization
from bunraku.client.reconnecting_connection import ReconnectingConnection, StreamEnded
from bunraku.client.server_problem import ServerProblem
from bunraku.motion.skeleton import JOINTS, TIP_JOINTS, Figure, standard_figure
from bunraku.playout.block_store import Pose
from bunraku.playout.clock import ReferenceClock
from bunraku.playout.performance import pack_sample
from bunraku.wire.errors import MalformedMessage
from bunraku.wire.messages import Ping, Pong, Problem, unpack

PING_INTERVAL_S = 1.0
INITIAL_PING_INTERVAL_S = 0.1
"""Interval of the first pings, which synchronise the clock."""
INITIAL_PINGS = 5
CONNECT_TIMEOUT_S = 10.0
FLUSH_TIMEOUT_S = 3.0
"""Time in which the last samples are received before the performance ends."""


class PerformerServer(Protocol):
    """Client of the server on which a performer performs. Methods raise `ServerProblem`."""

    token: str | None

    async def create_performer(self, new: Mapping[str, Any]) -> dict[str, Any]:
        """Bring a live performer on a stage."""

    async def performer(self, performer: str) -> dict[str, Any]:
        """Return one live performer."""

    async def end_performer(self, performer: str) -> None:
        """End a performance."""

    def socket_url(self, path: str) -> str:
        """Return the WebSocket URL of a path of the server."""


class Performer:
    """Live performer on the stage of a session. Use as an async context manager; leaving it ends the performance.

    A lost connection is established again; the track goes on if that takes less than 30 s.
    """

    def __init__(
        self,
        client: PerformerServer,
        figure: Figure | None = None,
        *,
        name: str = "",
        session: str | None = None,
        fps: float = 60.0,
        place: tuple[float, float, float] | None = None,
    ) -> None:
        """Prepare a performance in `session`, by default a new one.

        `figure` is the standard figure by default; `fps` the samples per second that are sent; `place` x and z in
        metres and the turn about y in radians, by default the next free place.
        """
        self._client = client
        self.figure = figure or standard_figure()
        fields = {"name": name, "fps": fps, "session": session, "place": place, "figure": _figure_json(self.figure)}
        self._request = {key: value for key, value in fields.items() if value is not None}
        self.description: dict[str, Any] = {}
        """The performer as the API shows it; `motion` is the motion that is in the library at the end."""
        self.clock = ReferenceClock()
        self.sent = 0
        """Samples sent."""
        self._connection: ReconnectingConnection | None = None
        self._tasks: list[asyncio.Task[None]] = []
        self._pings = self._answered = 0
        self._is_connected = asyncio.Event()
        self._has_answer = asyncio.Event()

    @property
    def session(self) -> str:
        """Id of the session."""
        return str(self.description["session"])

    @property
    def motion(self) -> str:
        """Id of the motion that is in the library when the performance has ended."""
        return str(self.description["motion"])

    @property
    def is_connected(self) -> bool:
        """True while there is a connection to the server, which may be lost without notice."""
        return self._connection is not None and self._connection.is_connected

    @property
    def reconnects(self) -> int:
        """Number of connections lost, or replaced because of silence."""
        return self._connection.reconnects if self._connection is not None else 0

    async def __aenter__(self) -> Self:
        self.description = await self._client.create_performer(self._request)
        try:
            self._connection = ReconnectingConnection(
                lambda: self._client.socket_url(self.description["input"]),
                self.clock.restart,
                self._on_bytes,
                headers=authorization(self._client.token),
            )
            self._tasks = [asyncio.create_task(self._connection.run()), asyncio.create_task(self._send_pings())]
            connected = asyncio.create_task(self._is_connected.wait())
            try:
                await asyncio.wait(
                    (connected, self._tasks[0]), timeout=CONNECT_TIMEOUT_S, return_when=asyncio.FIRST_COMPLETED
                )
            finally:
                connected.cancel()
            self._raise_ended()
            if not self._is_connected.is_set():
                raise StreamEnded("the server does not answer at the performer's socket")
        except BaseException:
            await self.__aexit__()
            raise
        return self

    async def __aexit__(self, *_: object) -> None:
        try:
            with contextlib.suppress(TimeoutError):
                async with asyncio.timeout(FLUSH_TIMEOUT_S):
                    await self._wait_until_received()
            # ended already, by somebody else or by a timeout; a server that is unreachable ends it by itself
            with contextlib.suppress(ServerProblem, httpx2.TransportError):
                await self._client.end_performer(self.description["id"])
        finally:
            for task in self._tasks:
                task.cancel()
            await asyncio.gather(*self._tasks, return_exceptions=True)

    async def frame(self, pose: Pose, time_s: float | None = None) -> None:
        """Send a pose: root (3,) in metres and unit quaternions (18, 4), each in the frame of its parent.

        `time_s` is the time of its capture on `time.monotonic`, now by default. A pose is lost while the connection is.
        Raise `StreamEnded` after the performance was ended.
        """
        self._raise_ended()
        assert self._connection is not None
        local = _monotonic_us() if time_s is None else round(time_s * 1e6)
        self.sent += 1
        await self._connection.send(pack_sample(round(self.clock.at(local)), pose, self.sent).pack())

    async def describe(self) -> dict[str, Any]:
        """Return the performer as the API shows it: its delay, and its samples by outcome."""
        return await self._client.performer(self.description["id"])

    async def wait_until_ended(self) -> None:
        """Wait until the performance was ended, by the server or by somebody else, and raise `StreamEnded`."""
        await asyncio.wait(self._tasks[:1])
        self._raise_ended()

    def _raise_ended(self) -> None:
        connection = self._tasks[0]
        if connection.done() and not connection.cancelled() and (error := connection.exception()) is not None:
            raise error if isinstance(error, StreamEnded) else StreamEnded(f"the connection failed: {error}")

    async def _wait_until_received(self) -> None:
        """Wait until the server has received all samples: it answers a Ping after them."""
        if not self.is_connected or self._tasks[0].done():
            return
        sequence = await self._send_ping()
        while self._answered < sequence:
            self._has_answer.clear()
            await self._has_answer.wait()

    def _on_bytes(self, data: bytes) -> None:
        try:
            message = unpack(data)
        except MalformedMessage:
            return
        if isinstance(message, Pong):
            self.clock.add_sample(message.sent, message.received, message.answered, _monotonic_us())
            self._answered = max(self._answered, message.sequence)
            self._is_connected.set()
            self._has_answer.set()
        elif isinstance(message, Problem) and self._connection is not None:
            self._connection.close_reason = f"{message.title}: {message.detail}"

    async def _send_pings(self) -> None:
        while True:
            sequence = await self._send_ping()
            is_synchronised = sequence > INITIAL_PINGS and self.clock.is_synchronised
            await asyncio.sleep(PING_INTERVAL_S if is_synchronised else INITIAL_PING_INTERVAL_S)

    async def _send_ping(self) -> int:
        """Send a Ping and return its number."""
        assert self._connection is not None
        self._pings += 1
        sequence = self._pings
        await self._connection.send(Ping(sequence, _monotonic_us()).pack())
        return sequence


def _monotonic_us() -> int:
    return time.monotonic_ns() // 1000


def _figure_json(figure: Figure) -> dict[str, dict[str, list[float]]]:
    return {
        "offsets": dict(zip(JOINTS, figure.offsets.tolist(), strict=True)),
        "tips": {JOINTS[joint]: figure.tips[joint].tolist() for joint in TIP_JOINTS},
    }
