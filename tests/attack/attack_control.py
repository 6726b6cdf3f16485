"""Floods of control connections, and WebSockets that are flooded but never read: rows 2, 4 and 11."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Callable

from bunraku.wire.messages import Alive, Ask, Bond, Claim, Edit, Input, Message, Ping, Put, Release
from tests.attack.attack_socket import BINARY, CALM, CLOSED_1008, MAX_WRITE_DEADLINE_S, PING, flood_and_read, repeat
from tests.attack.raw_socket import RawSocket, connect_websocket, frame
from tests.attack.registry import Report, Target, attack

MAX_READS = 100
"""Reads of what a connection still has received, before it is judged whether the server has ended it."""


def _control_flood(name: str, about: str, data: bytes, *, must_close: bool = False, connections: int = 1) -> None:
    """Register a flood of frames on control connections of the session."""

    async def run(target: Target, report: Report) -> None:
        token = target.tokens["control"]
        await asyncio.gather(*(
            flood_and_read(target, report, target.control, data, token=token, must_close=must_close)
            for _ in range(connections)
        ))  # fmt: skip

    run.__name__, run.__doc__ = name, about
    attack(2, CLOSED_1008 if must_close else CALM)(run)


def _messages(make: Callable[[int], Message]) -> bytes:
    """Return frames of the messages that `make` returns for successive numbers."""
    return repeat(*(frame(BINARY, make(number).pack()) for number in range(64)))


_control_flood(
    "ping_frames_on_a_control_connection",
    "Flood a control connection with Ping frames.",
    repeat(frame(PING)),
    must_close=True,
)
_control_flood(
    "unknown_messages_on_a_control_connection",
    "Flood a control connection with messages of unknown types.",
    repeat(frame(BINARY, b"\xc8")),
    must_close=True,
)
_control_flood(
    "clock_pings_on_a_control_connection",
    "Flood a control connection with clock messages.",
    _messages(lambda number: Ping(number, number)),
)
_control_flood(
    "claims_and_releases",
    "Flood a control connection with claims and releases of all limbs.",
    _messages(lambda number: Release(number % 16, 1) if number & 1 else Claim(number % 16)),
)
_control_flood(
    "requests_for_a_held_limb",
    "Flood a control connection with requests for a held limb and their withdrawals.",
    _messages(lambda number: Ask(0, bool(number & 1))),
)
_control_flood(
    "props_put_everywhere",
    "Flood a control connection with requests to put props into all limbs and on the floor.",
    _messages(
        lambda number: (
            Put(number % 8, place=[number / 8, -number / 8, 0.5]) if number & 1 else Put(number % 8, limb=number % 16)
        )
    ),
)
_control_flood(
    "bonds_of_all_limbs",
    "Flood a control connection with requests for bonds of all limbs and their ends.",
    _messages(lambda number: Bond([number % 16, number // 16 % 16], bool(number & 1))),
)
_control_flood(
    "keep_alive_messages",
    "Flood a control connection with keep-alive messages for all limbs.",
    _messages(lambda _: Alive(list(range(16)))),
)
_control_flood(
    "inputs_for_a_held_limb",
    "Flood a control connection with inputs for a limb that another puppeteer holds.",
    _messages(lambda number: Input(0, 1, 1, number, number, (0.4, 0.1, 0.4))),
)
_control_flood(
    "inputs_of_eight_puppeteers",
    "Flood eight control connections with inputs and claims.",
    _messages(lambda number: Input(number % 16, 0, 1, number, 0, (1.0, -1.0, 1.0)) if number % 4 else Claim(3)),
    connections=8,
)


@attack(2, CALM)
async def puppeteers_that_join_and_leave(target: Target, report: Report) -> None:
    """Join and leave with long names as fast as possible, so that the server notifies every viewer."""
    name = "%F0%9F%91%BE" * 200

    async def run(address: int) -> None:
        until = time.monotonic() + target.seconds
        while time.monotonic() < until:
            opened = await connect_websocket(
                target, f"{target.control}?name={name}", target.tokens["control"], address=address
            )
            if opened is not None:
                await opened.receive(0.5)
                opened.reset()
            report.count("refused" if opened is None else "joined")

    await asyncio.gather(*(run(address) for address in range(1, 9)))


@attack(4, f"{CALM}; output bounded, aborted after a write deadline", seconds=MAX_WRITE_DEADLINE_S)
async def pings_on_control_without_reading(target: Target, report: Report) -> None:
    """Send full Ping frames on a control connection and never read the answers."""
    await _flood_without_reading(target, report, target.control, "control", repeat(frame(PING, bytes(125))))


@attack(4, f"{CALM}; output bounded, aborted after a write deadline", seconds=MAX_WRITE_DEADLINE_S)
async def clock_pings_on_control_without_reading(target: Target, report: Report) -> None:
    """Send clock messages at the permitted rate on eight control connections and never read the answers."""
    data = frame(BINARY, Ping(1, 2).pack()) * 60

    async def run() -> None:
        opened = await connect_websocket(target, target.control, target.tokens["control"], receive_buffer_bytes=4_096)
        if opened is None:
            report.count("refused")
            return
        until = time.monotonic() + target.seconds
        while time.monotonic() < until and not opened.is_closed:
            await opened.send(data, 0.1)
            await asyncio.sleep(0.1)
        await _count_end(opened, report)

    await asyncio.gather(*(run() for _ in range(8)))
    _require_aborted(target, report)


@attack(4, f"{CALM}; output bounded, aborted after a write deadline", seconds=MAX_WRITE_DEADLINE_S)
async def edits_without_reading(target: Target, report: Report) -> None:
    """Seek on a private timeline and never read the blocks."""
    edits = b"".join(frame(BINARY, Edit(position=number * 50_000).pack()) for number in range(20))
    await _flood_without_reading(target, report, target.motion_stream, "view", edits)


@attack(11, "others can still control the session", probe="control", quick=True)
async def silent_puppeteers(target: Target, report: Report) -> None:
    """Take all places of a session with puppeteers that never read, while another subject wants to join."""
    opened = [
        await connect_websocket(target, target.control, target.tokens["control"], receive_buffer_bytes=4_096)
        for _ in range(40)
    ]
    report.count("opened", sum(one is not None for one in opened))
    await report.reach_peak()
    for one in opened:
        if one is not None:
            one.close()


async def _flood_without_reading(target: Target, report: Report, path: str, role: str, data: bytes) -> None:
    opened = await connect_websocket(target, path, target.tokens[role], receive_buffer_bytes=4_096)
    assert opened is not None
    until = time.monotonic() + target.seconds
    while time.monotonic() < until and not opened.is_closed:
        await opened.send(data, 1.0)
        await asyncio.sleep(0.01)
    await _count_end(opened, report)
    _require_aborted(target, report)


async def _count_end(opened: RawSocket, report: Report) -> None:
    """Count whether the server has ended the connection, and close it."""
    for _ in range(MAX_READS):
        # a kernel with a full receive buffer has dropped the server's reset: it is repeated once there is room
        if opened.is_closed or not await opened.receive(1.0):
            break
    report.count("aborted" if opened.is_closed else "still open")
    opened.close()


def _require_aborted(target: Target, report: Report) -> None:
    if target.seconds >= MAX_WRITE_DEADLINE_S:
        report.require(not report.answers["still open"], f"a connection is open after {MAX_WRITE_DEADLINE_S:g} s")
