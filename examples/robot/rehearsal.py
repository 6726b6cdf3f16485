"""Rehearsal without an audience: a server of its own with the demo dance, and two people who pull the strings."""

from __future__ import annotations

import asyncio
import contextlib
import math
import re
import sys
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from pathlib import Path

from bunraku.client import Client, ControlRefused, Puppeteer

START_TIMEOUT_S = 300.0
"""Time for a server to start; the first start on a machine compiles the codec."""
STOP_TIMEOUT_S = 20.0
INPUT_INTERVAL_S = 1 / 60
HOLD_S = 5.0
"""Time for which a person holds its limbs before it lets go of them."""
PAUSE_S = 1.0


@asynccontextmanager
async def demo_server(data: Path) -> AsyncIterator[str]:
    """Run `bunraku up --demo` on a free port with its data in a folder, and yield its URL.

    Raise RuntimeError with the server's output if it does not start.
    """
    command = (sys.executable, "-m", "bunraku.cli", "up", "--demo", "--port", "0", "--data", str(data))
    process = await asyncio.create_subprocess_exec(
        *command,
        stdin=asyncio.subprocess.DEVNULL,
        stdout=asyncio.subprocess.PIPE,
        stderr=asyncio.subprocess.STDOUT,
        # Ctrl-C in a terminal ends this program, which then ends the server
        start_new_session=True,
    )
    assert process.stdout is not None
    output = process.stdout
    lines: list[str] = []
    draining: asyncio.Task[None] | None = None
    try:
        async with asyncio.timeout(START_TIMEOUT_S):
            while (line := await output.readline()) and not (found := re.search(rb"(https?://\S+?)/?\s", line)):
                lines.append(line.decode(errors="replace"))
        if not line or found is None:
            raise RuntimeError("The server did not start:\n" + "".join(lines))
        draining = asyncio.create_task(_drain(output))
        yield found[1].decode()
    finally:
        with contextlib.suppress(ProcessLookupError):
            process.terminate()
        try:
            await asyncio.wait_for(process.wait(), STOP_TIMEOUT_S)
        except TimeoutError:
            process.kill()
            await process.wait()
        if draining is not None:
            draining.cancel()


async def _drain(output: asyncio.StreamReader) -> None:
    """Read what the server prints, so that it never waits for us."""
    while await output.readline():
        continue


def pull_hand(side: float, time_s: float) -> tuple[float, float, float]:
    """Return where a person pulls a hand (`side` 1 left, -1 right) after `time_s`: arm lengths on the trunk's axes.

    A wide circle before the body, and every 6 s a jerk over the head for a second.
    """
    if time_s % 6.0 > 5.0:
        return 0.3 * side, 0.85, 0.1
    angle = 2 * math.pi * 0.4 * time_s
    return side * (0.45 + 0.3 * math.cos(angle)), 0.45 * math.sin(angle), 0.5 + 0.3 * math.sin(0.7 * angle)


def pull_leg(time_s: float) -> float:
    """Return how far a person lifts a thigh after `time_s`, radians."""
    return 0.5 - 0.5 * math.cos(2 * math.pi * 0.3 * time_s)


async def pull_strings(client: Client, session: str, side: str, seconds: float) -> int:
    """Pull a hand and a leg of the first performer as one person for `seconds`; return the number of inputs.

    `side` is `left` or `right`. Both limbs are let go of for a second after each five, so that the dance is seen.
    """
    loop = asyncio.get_running_loop()
    begin, inputs = loop.time(), 0
    sign, hand, leg = (1.0 if side == "left" else -1.0), f"{side}_hand", f"{side}_leg"
    async with Puppeteer(client, session, name=f"{side.capitalize()} hand") as person:
        while (at := loop.time() - begin) < seconds:
            is_pause = at % (HOLD_S + PAUSE_S) > HOLD_S
            try:
                if is_pause:
                    await person.release(hand)
                    await person.release(leg)
                    await asyncio.sleep(PAUSE_S / 4)
                    continue
                await person.target(hand, *pull_hand(sign, at))
                await person.target(leg, pull_leg(at))
                inputs += 2
            except ControlRefused:
                # not held: at the start, after a pause, or taken away from a process that was suspended
                await person.ask(hand)
                await person.ask(leg)
            await asyncio.sleep(INPUT_INTERVAL_S)
    return inputs
