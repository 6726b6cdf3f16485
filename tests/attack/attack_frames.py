"""Violations of the WebSocket protocol and of the contract: rows 18 and 19."""

from __future__ import annotations

import asyncio
import random
import struct
import time

from bunraku.wire.messages import Ping
from tests.attack.raw_socket import ANSWER_TIMEOUT_S, OPEN, connect_websocket, frame, handshake, open_socket
from tests.attack.registry import Report, Target, attack

BINARY, TEXT, CONTINUATION, CLOSE, PING, PONG = 2, 1, 0, 8, 9, 10
QUIET = "no traceback in the log, no close code 1011"

# name: frames, expected close codes
VIOLATIONS: dict[str, tuple[bytes, tuple[int, ...]]] = {
    "bad UTF-8 in a Close frame": (frame(CLOSE, b"\x03\xe8\xff\xfe"), (1007,)),
    "truncated UTF-8 in a Close frame": (frame(CLOSE, b"\x03\xe8\xe3\x81"), (1007,)),
    "Close frame of one byte": (frame(CLOSE, b"\x03"), (1002,)),
    "Close frame with code 1005": (frame(CLOSE, struct.pack(">H", 1005)), (1002,)),
    "Close frame with code 999": (frame(CLOSE, struct.pack(">H", 999)), (1002,)),
    "Close frame of 126 bytes": (frame(CLOSE, bytes(126)), (1002,)),
    "fragmented Ping": (frame(PING, b"x", final=False), (1002,)),
    "Ping of 126 bytes": (frame(PING, bytes(126)), (1002,)),
    "unmasked frame": (b"\x82\x01\x40", (1002,)),
    "reserved bit": (b"\xc2\x80\0\0\0\0", (1002,)),
    "reserved data opcode": (frame(3), (1002,)),
    "reserved control opcode": (frame(11), (1002,)),
    "continuation without a message": (frame(CONTINUATION, b"x"), (1002,)),
    "message within a message": (frame(BINARY, b"x", final=False) + frame(BINARY, b"x"), (1002,)),
    "length with the highest bit": (b"\x82\xff" + b"\xff" * 8 + bytes(4), (1002, 1009)),
    "length of 2^62": (b"\x82\xff\x40" + bytes(7) + bytes(4), (1009,)),
    "length in more bytes than needed": (b"\x82\xfe\0\x01\0\0\0\0\xc8", (1000, 1002, 1005)),
    "text message": (frame(TEXT, b"hello"), (1008,)),
    "text message of bad UTF-8": (frame(TEXT, b"\xff\xfe"), (1007, 1008)),
    "empty message": (frame(BINARY), (1008,)),
    "message of 1,025 bytes": (frame(BINARY, b"\xc8" * 1_025), (1009,)),
    "1,025 bytes in fragments": (
        frame(BINARY, b"\xc8" * 600, final=False) + frame(CONTINUATION, b"\xc8" * 600),
        (1009,),
    ),
    "clock message of the wrong size": (frame(BINARY, b"\x40" + bytes(30)), (1008,)),
    "report that is not MessagePack": (frame(BINARY, b"\x42\xc1"), (1008,)),
    "report with a lying length": (frame(BINARY, b"\x42\xdf\xff\xff\xff\xff"), (1008,)),
    "report of nested arrays": (frame(BINARY, b"\x42" + b"\x91" * 1_000), (1008,)),
    "report with an extension type": (frame(BINARY, b"\x42\x81\xa6buffer\xd4\x01\x00"), (1008,)),
    "report with a huge integer": (frame(BINARY, b"\x42\x81\xa6buffer\xcf" + b"\xff" * 8), (1008,)),
}


@attack(19, "the close code of RFC 6455 and of the contract", quick=True)
async def violations_of_the_protocol(target: Target, report: Report) -> None:
    """Send one invalid frame or message on a stream and on a control connection."""
    for path, role in ((target.stream, "view"), (target.control, "control")):
        for name, (data, expected) in VIOLATIONS.items():
            if path == target.control and name.startswith("report"):
                continue
            opened = await connect_websocket(target, path, target.tokens[role])
            if opened is None:
                report.require(False, f"{name}: the handshake was refused")
                continue
            # the server may skip the frame: then a Close frame ends the connection
            await opened.send(data + frame(CLOSE) * (1000 in expected))
            code = await opened.read_close_code(ANSWER_TIMEOUT_S)
            report.count(str(code))
            kind = "control" if role == "control" else "stream"
            report.require(code in expected, f"{kind}: {name}: closed with {code}, expected {expected[0]}")
            opened.close()


async def _send_random_frames(target: Target, report: Report, paths: tuple[str, ...], role: str, seed: int) -> None:
    """Send random frames and messages on sockets of these paths, some of which are reset at once."""
    source = random.Random(seed)
    until = time.monotonic() + target.seconds

    async def run(address: int) -> None:
        while time.monotonic() < until:
            opened = await connect_websocket(target, source.choice(paths), target.tokens[role], address=address)
            if opened is None:
                report.count("refused")
                await asyncio.sleep(0.05)
                continue
            await opened.send(b"".join(_random_frame(source) for _ in range(source.randint(1, 8))))
            if source.random() < 0.4:
                opened.reset()
                report.count("reset")
                continue
            code = await opened.read_close_code(0.2)
            report.count(str(code))
            report.require(code != 1011, "a connection was closed with 1011")
            opened.close()

    await asyncio.gather(*(run(address) for address in range(1, 5)))


@attack(18, QUIET, quick=True)
async def random_bytes_on_control_connections(target: Target, report: Report) -> None:
    """Send random frames and messages on control connections."""
    await _send_random_frames(target, report, (target.control,), "control", 18)


@attack(18, QUIET)
async def random_bytes_on_streams(target: Target, report: Report) -> None:
    """Send random frames and messages on streams of a session and of a motion."""
    await _send_random_frames(target, report, (target.stream, target.motion_stream), "view", 81)


@attack(18, QUIET)
async def frames_before_the_handshake_is_answered(target: Target, report: Report) -> None:
    """Send frames in the same segment as the upgrade request, and reset some connections at once."""
    frames = frame(BINARY, Ping(1, 2).pack()) + frame(PING) * 50 + frame(CLOSE)
    paths = ((target.stream, "view"), (target.motion_stream, "view"), (target.control, "control"), (target.stream, ""))
    for number in range(24):
        path, role = paths[number % len(paths)]
        async with open_socket(target, address=1 + number // 8) as opened:
            await opened.send(handshake(target, path, target.tokens.get(role)) + frames)
            if number % 3 == 0:
                opened.reset()
                continue
            response = await opened.read_response(ANSWER_TIMEOUT_S)
            report.count(str(response.status) if response else "no response")
            code = await opened.read_close_code(ANSWER_TIMEOUT_S)
            report.count(f"close {code}")
            report.require(code != 1011, f"{path}: closed with 1011")
            report.require(code is not None or opened.is_closed, f"{path}: the frames are never answered")


@attack(18, QUIET)
async def handshakes_that_are_reset(target: Target, report: Report) -> None:
    """Reset connections during the handshake: before, while and after the server answers."""
    for number in range(60):
        path, role = ((target.stream, "view"), (target.control, "control"))[number & 1]
        async with open_socket(target, address=1 + number % 4) as opened:
            data = handshake(target, path, target.tokens[role])
            await opened.send(data[: len(data) - number % 3])
            await asyncio.sleep((number % 5) * 0.004)
            opened.reset()
            report.count("reset")


@attack(18, "no handshake ends with 1011 or 5xx", quick=True)
async def queries_out_of_range(target: Target, report: Report) -> None:
    """Open streams and control connections with parameters that no client sends."""
    have = f"{target.motion}.0.{'0' * 300}"
    queries = [
        *(f"rate={value}" for value in ("-1", "16", "99999999999999999999", "nan", "", "0x1", "%00")),
        *(f"at={value}" for value in ("nan", "inf", "-inf", "-1", "1e308", "1e-320", "", "a")),
        *(f"clock={value}" for value in ("-1", str(1 << 63), str(1 << 200), "nan", "1e300")),
        *(f"tracks={value}" for value in ("motion," * 9, "%FF", "nothing", ",,,", "motion%00")),
        *(f"have={value}" for value in (have, have * 2, "a.b.c", "." * 50, "%F0%9F%91%BE", "x.9999999.0z.99.0.0z")),
        *(f"name={value}" for value in ("%00", "%FF%FE", "%E2%80%AE", "a" * 4_000, "%ED%A0%80")),
        "&".join(f"a{number}=1" for number in range(50)),
        "ticket=" + "f" * 48,
        "ticket=" + "%F0%9F%91%BE" * 12,
        "ticket=",
        "%", "=", "&&&&", ";;;;",
    ]  # fmt: skip
    paths = ((target.stream, "view"), (target.motion_stream, "view"), (target.control, "control"))
    for number, query in enumerate(queries):
        for path, role in paths:
            async with open_socket(target, address=1 + number % 8) as opened:
                await opened.send(handshake(target, f"{path}?{query}", target.tokens[role]))
                response = await opened.read_response(ANSWER_TIMEOUT_S)
                if response is None:
                    report.count("no response")
                    report.require(False, f"{query[:40]}: no response")
                    continue
                report.count(str(response.status))
                report.require(response.status < 500, f"{query[:40]}: {response.status}")
                if response.status == 101:
                    await opened.send(frame(CLOSE))
                    code = await opened.read_close_code(ANSWER_TIMEOUT_S)
                    report.require(code != 1011, f"{query[:40]}: closed with 1011")


@attack(3, "connections are closed by the server", seconds=26.0)
async def upgrade_then_silence(target: Target, report: Report) -> None:
    """Open streams and control connections, with and without a token, read everything and never send anything."""
    paths = {
        "without a token": (target.stream, None),
        "without a token, control": (target.control, None),
        "unknown session": ("/v1/sessions/none/stream", target.tokens["view"]),
        "viewer": (target.stream, target.tokens["view"]),
    }

    async def run(name: str, path: str, token: str | None) -> None:
        opened = await connect_websocket(target, path, token)
        if opened is None:
            report.count("refused")
            return
        closed = await opened.wait_until_closed(target.seconds - 1.0)
        report.count("closed" if closed else OPEN)
        if target.seconds >= 26.0:
            report.require(closed, f"{name}: the connection is open after {target.seconds - 1.0:g} s")
        opened.close()

    await asyncio.gather(*(run(name, *one) for name, one in paths.items() for _ in range(10)))


def _random_frame(source: random.Random) -> bytes:
    """Return a frame that is invalid in most cases."""
    kind = source.random()
    payload = source.randbytes(source.choice((0, 1, 2, 8, 31, 125, 126, 300, 1_024, 1_100)))
    if kind < 0.5:
        # a known message type before random content
        return frame(BINARY, bytes((source.randint(60, 75),)) + payload)
    if kind < 0.8:
        return frame(source.randint(0, 15), payload[:125], final=source.random() < 0.8)
    return source.randbytes(source.randint(1, 40))
