"""Floods of WebSocket frames and messages: rows 1 and 2."""

from __future__ import annotations

import asyncio
import time

from bunraku.wire.messages import Edit, Ping
from bunraku.wire.messages import Report as ReportMessage
from tests.attack.raw_socket import RawSocket, connect_websocket, fetch_json, frame, handshake, open_socket
from tests.attack.registry import Report, Target, attack

CALM = "others' overlay gap p99 <= 1.3x calm"
CLOSED_1008 = f"{CALM}; the flooder is closed with 1008 within 2 s"
MAX_CLOSE_DELAY_S = 2.0
MAX_WRITE_DEADLINE_S = 35.0
"""Longest time for which the server may hold output that the client does not read, seconds."""
BATCH_BYTES = 1 << 16
BINARY, TEXT, CONTINUATION, CLOSE, PING, PONG = 2, 1, 0, 8, 9, 10


def repeat(*frames: bytes) -> bytes:
    """Return the frames repeated up to `BATCH_BYTES`."""
    batch = b"".join(frames)
    return batch * max(BATCH_BYTES // len(batch), 1)


async def flood(opened: RawSocket, data: bytes, until: float, batch_bytes: int | None = None) -> int:
    """Send `data` again and again until a time or until the connection is closed; return the bytes sent."""
    sent, step = 0, batch_bytes or len(data)
    while time.monotonic() < until:
        for at in range(0, len(data), step):
            if not await opened.send(data[at : at + step], 1.0) and opened.is_closed:
                return sent
            sent += step
            if time.monotonic() >= until:
                break
            await asyncio.sleep(0)
    return sent


async def flood_and_read(
    target: Target,
    report: Report,
    path: str,
    data: bytes,
    *,
    token: str | None,
    must_close: bool = True,
    batch_bytes: int | None = None,
    what: str = "the flooder",
) -> None:
    """Flood one WebSocket while reading, and record how it was closed."""
    opened = await connect_websocket(target, path, token)
    if opened is None:
        report.count("refused")
        report.require(False, f"the handshake of {what} was not answered")
        return
    began = time.monotonic()
    flooding = asyncio.create_task(flood(opened, data, began + target.seconds, batch_bytes))
    code = await opened.read_close_code(target.seconds)
    delay = time.monotonic() - began
    report.count(str(code or ("closed without a code" if opened.is_closed else "still open")))
    if must_close:
        # in a short run the connection may be open for the whole attack
        late = code is None and not opened.is_closed and target.seconds < MAX_CLOSE_DELAY_S
        report.require(code == 1008 or late, f"{what} was closed with {code}, expected 1008")
        report.require(delay <= MAX_CLOSE_DELAY_S + 1.0, f"{what} was closed after {delay:.1f} s, expected 2 s")
    await flooding
    opened.close()


async def flood_from_many(target: Target, report: Report, path: str, data: bytes, connections: int) -> None:
    """Flood several WebSockets at once."""
    runs = (flood_and_read(target, report, path, data, token=target.tokens["view"]) for _ in range(connections))
    await asyncio.gather(*runs)


@attack(1, CALM, quick=True)
async def pings_after_4401(target: Target, report: Report) -> None:
    """Open a stream without a token, get 4401, and send empty pings until the server closes the connection."""
    opened = await connect_websocket(target, target.stream)
    assert opened is not None
    code = await opened.read_close_code()
    report.count(str(code))
    report.require(code == 4401, f"the close code is {code}, expected 4401")
    sent = await flood(opened, repeat(frame(PING)), time.monotonic() + target.seconds)
    report.count("pings", sent // len(frame(PING)))
    opened.close()


@attack(1, CALM)
async def frames_after_4401_on_fifty_connections(target: Target, report: Report) -> None:
    """Do the same with all kinds of frames on fifty connections, of which the server's frames are never read."""
    data = repeat(frame(PONG, b"abcd"), frame(BINARY, b"\xc8"), frame(CONTINUATION), frame(PING, bytes(125)))

    async def run() -> None:
        opened = await connect_websocket(target, target.control)
        if opened is None:
            report.count("refused")
            return
        await flood(opened, data, time.monotonic() + target.seconds)
        report.count("closed" if opened.is_closed else "still open")
        opened.close()

    await asyncio.gather(*(run() for _ in range(50)))


@attack(1, CALM)
async def handshakes_without_a_token(target: Target, report: Report) -> None:
    """Open streams without a token as fast as possible, from four addresses."""

    async def run(address: int) -> None:
        until = time.monotonic() + target.seconds
        while time.monotonic() < until:
            async with open_socket(target, address=address) as opened:
                await opened.send(handshake(target, target.stream))
                report.count(await opened.describe_reaction())

    await asyncio.gather(*(run(address) for address in range(1, 5) for _ in range(8)))


@attack(1, f"{CALM}; closed within the header timeout")
async def body_after_401(target: Target, report: Report) -> None:
    """Send an upload without a token and its body in 1-byte chunks after the 401."""
    path = "/v1/motions?filename=a.bvh"
    head = f"POST {path} HTTP/1.1\r\nHost: {target.host}\r\nTransfer-Encoding: chunked\r\n\r\n".encode()

    async def run() -> None:
        async with open_socket(target) as opened:
            await opened.send(head)
            report.count(await opened.describe_reaction())
            await flood(opened, repeat(b"1\r\nx\r\n"), time.monotonic() + target.seconds)
            report.count("closed" if opened.is_closed else "still open")

    await asyncio.gather(*(run() for _ in range(8)))


def _stream_flood(name: str, about: str, data: bytes, *, connections: int = 1, quick: bool = False) -> None:
    """Register a flood of frames on the stream of the session."""

    async def run(target: Target, report: Report) -> None:
        await flood_from_many(target, report, target.stream, data, connections)

    run.__name__, run.__doc__ = name, about
    attack(2, CLOSED_1008, quick=quick)(run)


_stream_flood("ping_frames", "Flood a stream with empty Ping frames.", repeat(frame(PING)), quick=True)
_stream_flood("full_ping_frames", "Flood a stream with Ping frames of 125 bytes.", repeat(frame(PING, bytes(125))))
_stream_flood("pong_frames", "Flood a stream with empty Pong frames.", repeat(frame(PONG)))
_stream_flood(
    "acknowledging_pongs", "Flood a stream with Pong frames that acknowledge data.", repeat(frame(PONG, b"\0\0\0\1"))
)
_stream_flood(
    "clock_pings",
    "Flood a stream with clock messages (Ping, 64).",
    repeat(frame(BINARY, Ping(1, 2).pack())),
    quick=True,
)
_stream_flood("unknown_messages", "Flood a stream with messages of unknown types.", repeat(frame(BINARY, b"\xc8")))
_stream_flood(
    "foreign_messages", "Flood a stream with messages of the other connection.", repeat(frame(BINARY, b"\x43\x80"))
)
_stream_flood("reports", "Flood a stream with reports.", repeat(frame(BINARY, ReportMessage(1).pack())))
_stream_flood(
    "many_fragmented_messages",
    "Flood a stream with messages in single bytes.",
    repeat(frame(BINARY, b"\xc8", final=False), *[frame(CONTINUATION, b"x", final=False)] * 8, frame(CONTINUATION)),
)
_stream_flood(
    "pings_within_a_message",
    "Flood a stream with pings between the fragments of a message.",
    repeat(frame(BINARY, b"\xc8", final=False), frame(PING), frame(PONG), frame(CONTINUATION)),
)
_stream_flood(
    "large_unknown_messages",
    "Flood a stream with unknown messages of the maximum size.",
    repeat(frame(BINARY, b"\xc8" + bytes(1_023))),
)
_stream_flood("pings_on_fifty_streams", "Flood fifty streams with Ping frames.", repeat(frame(PING)), connections=50)
_stream_flood(
    "mixed_frames_on_fifty_streams",
    "Flood fifty streams with all kinds of frames.",
    repeat(frame(PONG), frame(BINARY, b"\xc8"), frame(BINARY, Ping(1, 2).pack()), frame(PING, b"x")),
    connections=50,
)


@attack(2, CLOSED_1008)
async def fragmented_message_without_end(target: Target, report: Report) -> None:
    """Begin a message and send empty fragments of it without end."""
    opened = await connect_websocket(target, target.stream, target.tokens["view"])
    assert opened is not None
    await opened.send(frame(BINARY, final=False))
    began = time.monotonic()
    flooding = asyncio.create_task(flood(opened, repeat(frame(CONTINUATION, final=False)), began + target.seconds))
    code = await opened.read_close_code(target.seconds)
    report.count(str(code))
    report.require(code == 1008, f"the flooder was closed with {code}, expected 1008")
    delay = time.monotonic() - began
    report.require(delay <= MAX_CLOSE_DELAY_S + 1.0, f"the flooder was closed after {delay:.1f} s, expected 2 s")
    await flooding
    opened.close()


@attack(2, CLOSED_1008)
async def edits_of_an_own_timeline(target: Target, report: Report) -> None:
    """Seek on a private timeline as fast as possible."""
    edits = repeat(*(frame(BINARY, Edit(position=number * 10_000).pack()) for number in range(64)))
    await flood_and_read(target, report, target.motion_stream, edits, token=target.tokens["view"])


@attack(2, CALM)
async def edits_of_fifty_timelines(target: Target, report: Report) -> None:
    """Seek on fifty private timelines, each at the rate of a person who drags a slider."""
    edits = [frame(BINARY, Edit(position=number * 50_000).pack()) for number in range(60)]

    async def run() -> None:
        opened = await connect_websocket(target, target.motion_stream, target.tokens["view"])
        if opened is None:
            report.count("refused")
            return
        until = time.monotonic() + target.seconds
        number = 0
        while time.monotonic() < until and not opened.is_closed:
            await opened.send(edits[number % len(edits)])
            number += 1
            await opened.receive(1 / 20)
        report.count("closed" if opened.is_closed else "still open")
        opened.close()

    await asyncio.gather(*(run() for _ in range(50)))


@attack(2, CALM)
async def single_byte_segments(target: Target, report: Report) -> None:
    """Send Ping frames on twenty streams, each byte in a separate TCP segment."""

    async def run() -> None:
        opened = await connect_websocket(target, target.stream, target.tokens["view"])
        if opened is None:
            report.count("refused")
            return
        reading = asyncio.create_task(opened.read_close_code(target.seconds))
        await flood(opened, frame(PING) * 16, time.monotonic() + target.seconds, 1)
        report.count(str(await reading))
        opened.close()

    await asyncio.gather(*(run() for _ in range(20)))


@attack(2, CALM)
async def reconnect_storm(target: Target, report: Report) -> None:
    """Open and leave streams as fast as possible from eight addresses, each with a description of held blocks."""
    levels = "0" * 64
    runs = ".".join(["0", "0z0z0z"] * 3)
    path = f"{target.stream}?have={target.motion}.0.{levels}.1.{runs}"[:470]

    async def run(address: int) -> None:
        until = time.monotonic() + target.seconds
        while time.monotonic() < until:
            opened = await connect_websocket(target, path, target.tokens["view"], address=address)
            if opened is not None:
                await opened.receive(0.2)
                opened.reset()
            report.count("refused" if opened is None else "opened")

    await asyncio.gather(*(run(address) for address in range(1, 9)))


@attack(2, f"{CALM}; closed with 4401 within 3 s")
async def sockets_of_a_revoked_link(target: Target, report: Report) -> None:
    """Flood twenty streams that were opened with a share link, and revoke the link."""
    token = target.tokens["control"]
    share = await fetch_json(target, "POST", "/v1/shares", {"session": target.session}, token=token)
    assert share is not None
    assert share.status == 201, share.status
    link = share.json()
    opened = [await connect_websocket(target, target.stream, link["token"]) for _ in range(20)]
    revoked = await fetch_json(target, "DELETE", f"/v1/shares/{link['id']}", None, token=token)
    report.count(f"revoked {revoked.status if revoked else None}")
    codes = await asyncio.gather(*(one.read_close_code(3.0) for one in opened if one is not None))
    for code in codes:
        report.count(str(code))
    report.require(len(codes) == 20, "a stream with a valid link was refused")
    report.require(set(codes) == {4401}, f"streams of a revoked link were closed with {set(codes)}, expected 4401")
    again = await connect_websocket(target, target.stream, link["token"])
    report.require(again is not None and await again.read_close_code() == 4401, "a revoked link opens a stream")
    for one in (*opened, again):
        if one is not None:
            one.close()
