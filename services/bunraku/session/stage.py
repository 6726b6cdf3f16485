"""One session: its timeline, its puppeteers, and the merge of their limbs into the dance (paper 5).

The stage publishes on the bus, on `session.{id}.`: `timeline` (message 4), `presence` (6), `overlay` (5); it listens to
`viewers` and answers `state`. Overlays are computed for the instant when they are due, `LEAD` ahead of now, so that
every viewer can lay them over the dance in time and at the same time.
"""

from __future__ import annotations

import asyncio
import contextlib
import secrets
from collections import deque
from dataclasses import dataclass, field

import msgpack

from bunraku.backing.backing import clock
from bunraku.backing.bus import Bus, Subscription
from bunraku.backing.library import StoredMotion
from bunraku.codec.decode import decode_block
from bunraku.marionette.merge import Marionette
from bunraku.marionette.ownership import Grant as Granted
from bunraku.marionette.ownership import Input as Given
from bunraku.playout import timeline
from bunraku.playout.blocks import BlockStore, Pose
from bunraku.playout.overlays import pack_joints
from bunraku.wire import messages
from bunraku.wire.messages import (
    Alive,
    Claim,
    Data,
    Grant,
    Input,
    Overlay,
    Presence,
    Refusal,
    Release,
    TimelineState,
    Welcome,
)

LEAD = 100_000
"""How far ahead of now overlays and edits are due, microseconds."""
TICK = 1 / 60
QUEUE = 64
"""Messages that may wait for a puppeteer."""
COLOURS = 5
PUPPETEERS = 32
"""Puppeteers of one session."""


class Full(Exception):
    """A session that has as many puppeteers as it may."""


@dataclass(eq=False, slots=True)
class Puppeteer:
    """One who may take limbs, and what is still to be said to them."""

    id: str
    name: str
    colour: int
    waiting: deque[bytes] = field(default_factory=deque)
    wake: asyncio.Event = field(default_factory=asyncio.Event)
    overrun: bool = False

    def tell(self, message: bytes) -> None:
        """Queue a message; too many that wait mark the puppeteer as overrun."""
        if len(self.waiting) >= QUEUE:
            self.overrun = True
        else:
            self.waiting.append(message)
        self.wake.set()


class Stage:
    """A motion on a shared timeline, and those who pull at it."""

    def __init__(
        self, session: str, motion: StoredMotion, marionette: Marionette, bus: Bus, *, playing: bool, loop: bool
    ) -> None:
        """`marionette` is of the motion's figure; the caller builds it, which takes a tenth of a second."""
        self.id = session
        self.created = clock()
        self._bus = bus
        self._timelines = timeline.Timelines()
        self._timelines.put(timeline.start(motion.id, motion.track.duration_us, clock(), playing=playing, loop=loop))
        self._puppeteers: dict[str, Puppeteer] = {}
        self._viewers: dict[str, int] = {}
        self._engaged = asyncio.Event()
        self._sequence = 0
        self._overlay: bytes | None = None
        self.seen = clock()
        self._marionette = marionette
        self._set(motion)
        subject = f"session.{session}"
        self._subscriptions: list[Subscription] = [
            bus.answer(f"{subject}.state", self._state),
            bus.subscribe(f"{subject}.viewers", self._on_viewers),
        ]
        self._ticking = asyncio.create_task(self._run(), name=f"stage {session}")

    async def close(self) -> None:
        """End the session; its puppeteers are told nothing more."""
        self._ticking.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await self._ticking
        for subscription in self._subscriptions:
            subscription.end()

    @property
    def timeline(self) -> TimelineState:
        """The newest timeline."""
        newest = self._timelines.newest
        assert newest is not None
        return newest

    @property
    def people(self) -> int:
        """Viewers and puppeteers."""
        return sum(self._viewers.values()) + len(self._puppeteers)

    @property
    def presence(self) -> Presence:
        """Who is here and who holds what."""
        puppeteers = [{"id": p.id, "name": p.name, "colour": p.colour} for p in self._puppeteers.values()]
        return Presence(sum(self._viewers.values()), puppeteers, list(self._marionette.holders()))

    def edit(self, *, playing: bool | None, position: int | None, loop: bool | None) -> TimelineState:
        """Edit the timeline for everyone, `LEAD` from now."""
        return self._put(timeline.edit(self.timeline, clock() + LEAD, playing=playing, position=position, loop=loop))

    async def change(self, motion: StoredMotion) -> TimelineState:
        """Another motion for everyone, from its start; limbs stay in the hands they are in."""
        await asyncio.to_thread(self._marionette.set_figure, motion.track.figure)
        self._set(motion)
        return self._put(timeline.change(self.timeline, clock() + LEAD, motion.id, motion.track.duration_us))

    def join(self, name: str) -> Puppeteer:
        """A puppeteer comes, with the first free colour; raises `Full`."""
        if len(self._puppeteers) >= PUPPETEERS:
            raise Full(f"{PUPPETEERS} puppeteers are here already")
        used = [p.colour for p in self._puppeteers.values()]
        colour = min(range(COLOURS), key=lambda c: (used.count(c), c))
        puppeteer = Puppeteer(secrets.token_hex(5), name, colour)
        self._puppeteers[puppeteer.id] = puppeteer
        puppeteer.tell(Welcome(puppeteer.id, colour, LEAD).pack())
        self._announce()
        return puppeteer

    def leave(self, puppeteer: Puppeteer) -> None:
        """A puppeteer goes; what they held goes back to the dance."""
        self._puppeteers.pop(puppeteer.id, None)
        self._marionette.leave(puppeteer.id, clock())
        self._announce()

    def hear(self, puppeteer: Puppeteer, message: messages.Message | None) -> None:
        """What a puppeteer's controller says."""
        now = clock()
        if isinstance(message, Claim):
            answer = self._marionette.claim(message.limb, puppeteer.id, now)
            if isinstance(answer, Granted):
                puppeteer.tell(Grant(answer.limb, answer.epoch).pack())
                self._engaged.set()
                self._announce()
            else:
                puppeteer.tell(Refusal(message.limb, answer.reason, answer.holder).pack())
        elif isinstance(message, Release):
            if self._marionette.release(message.limb, puppeteer.id, message.epoch, now):
                self._announce()
        elif isinstance(message, Alive):
            self._marionette.alive(puppeteer.id, message.limbs, now)
        elif isinstance(message, Input):
            given = Given(message.limb, message.kind, message.epoch, message.sequence, message.sampled, message.values)
            self._marionette.input(puppeteer.id, given, now)

    def _set(self, motion: StoredMotion) -> None:
        self._motion = motion
        self._dance = BlockStore(motion.track)

    def _put(self, state: TimelineState) -> TimelineState:
        self._timelines.put(state)
        self._bus.publish(f"session.{self.id}.timeline", state.pack())
        return state

    def _announce(self) -> None:
        self.seen = clock()
        packed = self.presence.pack()
        self._bus.publish(f"session.{self.id}.presence", packed)
        for puppeteer in self._puppeteers.values():
            puppeteer.tell(packed)

    async def _state(self, _: bytes) -> bytes:
        packed: bytes = msgpack.packb([self.timeline.pack(), self.presence.pack(), self._overlay])
        return packed

    def _on_viewers(self, message: bytes) -> None:
        replica, count = msgpack.unpackb(message)
        self._viewers[replica] = count
        if count == 0:
            del self._viewers[replica]
        self._announce()

    async def _run(self) -> None:
        loop = asyncio.get_running_loop()
        while True:
            await self._engaged.wait()
            due = loop.time()
            while True:
                await self._prepare(clock() + LEAD)
                if not self._tick(clock()):
                    break
                due = max(due + TICK, loop.time() - TICK)
                await asyncio.sleep(max(due - loop.time(), 0))
            self._engaged.clear()

    def _tick(self, now: int) -> bool:
        """Publish the overlay due `LEAD` from `now`; whether any limb is still pulled."""
        lost = self._marionette.expire(now)
        for limb, holder in lost:
            if holder in self._puppeteers:
                self._puppeteers[holder].tell(Refusal(int(limb), "lost").pack())
        if lost:
            self._announce()
        due = now + LEAD
        pose = self._pose(due)
        pulled = self._marionette.overlay(pose[1], now) if pose is not None else None
        self._sequence += 1
        limbs = dict(zip(map(int, pulled.limbs), map(pack_joints, pulled.rotations), strict=True)) if pulled else {}
        self._overlay = Overlay(self._sequence, due, limbs).pack() if limbs else None
        self._bus.publish(f"session.{self.id}.overlay", self._overlay or Overlay(self._sequence, due, {}).pack())
        return pulled is not None or any(self._marionette.holders())

    async def _prepare(self, due: int) -> None:
        """Decode what `_pose` will need about `due`, in a thread: it takes milliseconds, the first time seconds."""
        track, packets = self._motion.track, self._motion.dance[-1]
        first = track.block_at(timeline.position_at(self.timeline, due))
        for index in (first, (first + 1) % track.blocks):
            if self._dance.rate(index) < 0:
                dance, packet = self._dance, Data.unpack(packets[index])
                dance.put(index, packet.rate, await asyncio.to_thread(decode_block, track, packet.block))

    def _pose(self, due: int) -> Pose | None:
        """The dance at clock time `due`, at its best rate."""
        state = self._timelines.at(due)
        if state is None or state.motion != self._motion.id:
            return None
        return self._dance.pose_at(timeline.position_at(state, due), state.loop)
