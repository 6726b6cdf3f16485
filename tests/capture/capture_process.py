"""`bunraku capture` as a process, and a performer whose packets of VMC it receives."""

from __future__ import annotations

import asyncio
import socket
import sys
import time
from collections.abc import AsyncIterator, Sequence
from contextlib import asynccontextmanager
from pathlib import Path

from tests.capture.samples import sample_performance
from tests.capture.vmc_performer import make_bundle, make_messages
from tests.time_limit import HANG_TIMEOUT_S

BUNRAKU = Path(sys.executable).parent / "bunraku"
FPS = 30.0
"""Frames per second of the performer."""


def make_packet(number: int) -> bytes:
    """Return the packet of a frame of the sample performance, which repeats."""
    performance = sample_performance()
    return make_bundle(make_messages(performance, number % performance.frame_count, number / FPS))


@asynccontextmanager
async def run_capture(*arguments: str, prefix: Sequence[str] = ()) -> AsyncIterator[asyncio.subprocess.Process]:
    """Run `bunraku capture`, from the moment at which it listens, and end it; the command follows `prefix`."""
    process = await asyncio.create_subprocess_exec(
        *prefix,
        BUNRAKU,
        "capture",
        *arguments,
        stdin=asyncio.subprocess.PIPE,
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.PIPE,
    )
    try:
        assert process.stderr is not None
        async with asyncio.timeout(HANG_TIMEOUT_S):
            assert b"Listening for VMC" in await process.stderr.readline()
        yield process
    finally:
        if process.returncode is None:
            process.kill()
        await process.communicate()


async def send_packets(port: int, count: int, sent_us: dict[int, int] | None = None) -> None:
    """Send the packets of a performer in real time: times of frames come from their arrivals, too.

    `sent_us` receives the time of each frame on `time.monotonic`, in microseconds.
    """
    # the first one takes long
    make_packet(0)
    begin_s = time.monotonic()
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
        for number in range(count):
            # the performer's clock is right, also on a machine that is late
            await asyncio.sleep(max(begin_s + number / FPS - time.monotonic(), 0.0))
            if sent_us is not None:
                sent_us[number] = round(1e6 * (begin_s + number / FPS))
            sender.sendto(make_packet(number), ("127.0.0.1", port))


@asynccontextmanager
async def performing(port: int, sent_us: dict[int, int] | None = None) -> AsyncIterator[None]:
    """Send packets until the context ends."""
    sending = asyncio.create_task(send_packets(port, 1_000_000, sent_us))
    try:
        yield
    finally:
        sending.cancel()
        await asyncio.gather(sending, return_exceptions=True)
