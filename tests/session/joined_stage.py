"""Puppeteers on a stage and the messages that the stage publishes."""

from __future__ import annotations

import asyncio
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from dataclasses import dataclass

from bunraku.codec.container import StoredMotion, pack_motion, unpack_motion
from bunraku.codec.motion_encoder import encode_motion
from bunraku.messaging.bus import MemoryBus
from bunraku.session.puppeteer_roster import Puppeteer
from bunraku.session.stage import (
    Stage,
)
from bunraku.wire.messages import (
    Alive,
    Grant,
    unpack,
)
from bunraku.wire.overlay import Overlay
from tests.time_limit import HANG_TIMEOUT_S
from tests.vectors.blocks import random_motion


class StageMessages:
    """Messages of a stage on the bus."""

    def __init__(self, bus: MemoryBus) -> None:
        self.messages: list[object] = []
        self._more = asyncio.Event()
        for subject in ("timeline", "presence", "overlay", "live"):
            bus.subscribe(f"session.s.{subject}", self._receive)

    def _receive(self, message: bytes) -> None:
        self.messages.append(unpack(message))
        self._more.set()

    async def wait_for(self, number: int, kind: type) -> list[object]:
        async with asyncio.timeout(HANG_TIMEOUT_S):
            while len(found := [m for m in self.messages if isinstance(m, kind)]) < number:
                self._more.clear()
                await self._more.wait()
        return found

    async def wait_until_at_rest(self) -> None:
        """Wait for an overlay without limbs."""
        count = 1
        while (found := await self.wait_for(count, Overlay)) and found[-1].limbs:  # type: ignore[attr-defined]
            count = len(found) + 1


def stored_motion(name: str, seed: int) -> StoredMotion:
    """Return a motion as the motion store returns it."""
    encoded = encode_motion(random_motion(2.3, 30.0, seed), error_bounds_mm=(30.0, 5.0), grade="live")
    return unpack_motion(name, pack_motion(name, encoded))


@dataclass
class JoinedPuppeteer:
    """Puppeteer who has joined a stage, and the messages it has received."""

    puppeteer: Puppeteer
    received: list[bytes]

    @property
    def id(self) -> str:
        return self.puppeteer.id


def join_stage(stage: Stage, name: str) -> JoinedPuppeteer:
    received: list[bytes] = []
    return JoinedPuppeteer(stage.join(name.lower(), name, received.append), received)


def last_grant(joined: JoinedPuppeteer) -> Grant:
    return next(m for m in map(unpack, reversed(joined.received)) if isinstance(m, Grant))


@asynccontextmanager
async def keep_holding(stage: Stage, joined: JoinedPuppeteer, limb: int) -> AsyncIterator[None]:
    """Send heartbeats for a limb until the context ends."""

    async def send_heartbeats() -> None:
        while True:
            stage.receive(joined.puppeteer, Alive([limb]))
            await asyncio.sleep(0.05)

    heartbeats = asyncio.create_task(send_heartbeats())
    try:
        yield
    finally:
        heartbeats.cancel()
