"""One session: its timeline, its puppeteers, and the merge of their limbs into the dance (paper 5).

The stage publishes on the bus, on `session.{id}.`: `timeline` (message 4), `presence` (6), `overlay` (5), and `appear`
where it goes on with a session of another replica; it listens to `viewers` and answers `state`. Overlays are computed
for the instant when they are due, `LEAD` ahead of now, so that every viewer can lay them over the dance in time and at
the same time.
"""

from __future__ import annotations

import asyncio
import contextlib
import secrets
import time
from collections.abc import Callable

import msgpack

from bunraku.backing.backing import clock
from bunraku.backing.bus import Bus, Subscription
from bunraku.backing.library import StoredMotion
from bunraku.marionette.log import Log, LoggedTroupe
from bunraku.marionette.ownership import Grant as Granted
from bunraku.marionette.ownership import Input as Given
from bunraku.marionette.ownership import Outcome
from bunraku.marionette.troupe import Laid, Troupe
from bunraku.motion.skeleton import Figure
from bunraku.playout import timeline
from bunraku.playout.overlays import pack_joints
from bunraku.session.deafness import Deafness
from bunraku.session.pace import Pace
from bunraku.session.poses import Poses
from bunraku.session.puppeteers import Puppeteer, Puppeteers
from bunraku.session.tally import Tally
from bunraku.wire import messages
from bunraku.wire.messages import Alive, Ask, Claim, Grant, Input, Presence, Refusal, Release, TimelineState, Welcome
from bunraku.wire.overlay import Overlay

LEAD = 60_000
"""How far ahead of now overlays are due, microseconds: a message every two frames, and its way to a viewer near by."""
EDIT_LEAD = 100_000
"""How far ahead of now edits of the timeline are due, microseconds."""
FRAME = Overlay.FRAME
FRAMES = 2
"""Frames in one message: on a narrow line packets count, not bytes."""
LONGEST_PAUSE = 6
"""Frames: a stage that was kept from working for longer leaves them out."""
COUNTED = 0.5
"""Seconds between two tellings of how many watch."""


class Stage:
    """A motion on a shared timeline, and those who pull at it."""

    def __init__(
        self,
        session: str,
        motion: StoredMotion,
        troupe: Troupe,
        bus: Bus,
        state: TimelineState,
        created: int,
        tally: Tally | None = None,
    ) -> None:
        """`troupe` is of the motion's figures; the caller builds it, which takes a tenth of a second. `state` is of
        this motion; `created` a clock time, microseconds; `tally` counts what goes on at all stages of a replica."""
        self.id = session
        self.created = created
        self._bus = bus
        self._tally = tally or Tally()
        self._timelines = timeline.Timelines()
        self._timelines.put(state)
        self.puppeteers = Puppeteers()
        self._viewers: dict[str, int] = {}
        self._counting: asyncio.TimerHandle | None = None
        self._engaged = asyncio.Event()
        self._deafness = Deafness()
        self._sequence = 0
        self._phase = secrets.randbelow(FRAMES * FRAME)
        self._overlay: bytes | None = None
        self.seen = clock()
        self.log = Log()
        self.log.timeline(self.timeline)
        self._troupe = LoggedTroupe(troupe, motion.id, self.log)
        self._set(motion)
        subject = f"session.{session}"
        self._subscriptions: list[Subscription] = [
            bus.answer(f"{subject}.state", self._state),
            bus.subscribe(f"{subject}.viewers", self._on_viewers),
        ]
        self._ticking = asyncio.create_task(self._run(), name=f"stage {session}")

    async def close(self) -> None:
        """End the session; its puppeteers are told nothing more."""
        if self._counting is not None:
            self._counting.cancel()
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

    def appear(self) -> None:
        """Tell those who watched when the session was another replica's where it goes on: nobody holds a limb."""
        self._bus.publish(f"session.{self.id}.appear", b"")
        self._bus.publish(f"session.{self.id}.timeline", self.timeline.pack())
        self._announce()
        self._sequence += 1
        self._bus.publish(f"session.{self.id}.overlay", Overlay(self._sequence, clock() + LEAD, {}).pack())

    @property
    def people(self) -> int:
        """Viewers and puppeteers."""
        return sum(self._viewers.values()) + len(self.puppeteers)

    @property
    def holders(self) -> tuple[str | None, ...]:
        """The holder's id of each limb, or None."""
        return self._troupe.troupe.holders()

    @property
    def presence(self) -> Presence:
        """Who is here, who holds what, and who asks for it."""
        puppeteers = [{"id": p.id, "name": p.name, "colour": p.colour} for p in self.puppeteers]
        troupe = self._troupe.troupe
        asks = [list(limb) for limb in troupe.asks()]
        return Presence(sum(self._viewers.values()), puppeteers, list(troupe.holders()), asks)

    def edit(self, *, playing: bool | None, position: int | None, loop: bool | None) -> TimelineState:
        """Edit the timeline for everyone, `EDIT_LEAD` from now."""
        due = clock() + EDIT_LEAD
        return self._put(timeline.edit(self.timeline, due, playing=playing, position=position, loop=loop))

    async def change(self, motion: StoredMotion) -> TimelineState:
        """Another motion for everyone, from its start; limbs stay in the hands they are in."""
        # the first arm of its proportions takes a tenth of a second; the loop goes on meanwhile
        await asyncio.to_thread(troupe_of, motion)
        now, before = clock(), self.holders
        for limb, holder in self._troupe.set_figures(_figures(motion), motion.id, now):
            if (puppeteer := self.puppeteers.get(holder)) is not None:
                puppeteer.lost(limb, now)
        self._set(motion)
        state = self._put(timeline.change(self.timeline, clock() + EDIT_LEAD, motion.id, motion.track.duration_us))
        if len(self.holders) != len(before):
            self._announce()
        return state

    def join(self, who: str, name: str, tell: Callable[[bytes], None]) -> Puppeteer:
        """A puppeteer comes, of the id `who`, and is told what there is with `tell`; raises `Full`."""
        puppeteer = self.puppeteers.join(who, name, tell, clock())
        puppeteer.tell(Welcome(puppeteer.id, puppeteer.colour, LEAD).pack())
        self._announce()
        return puppeteer

    def leave(self, puppeteer: Puppeteer) -> None:
        """A puppeteer goes; what they held goes to who asked for it, or back to the dance."""
        self.puppeteers.leave(puppeteer)
        now = clock()
        self._troupe.leave(puppeteer.id, now)
        self._settle(now)
        self._announce()

    def hear(self, puppeteer: Puppeteer, message: messages.Message | None) -> None:
        """What a puppeteer's controller says."""
        now = clock()
        who = puppeteer.id
        if isinstance(message, Claim):
            answer = self._troupe.claim(message.limb, who, now)
            if isinstance(answer, Granted):
                self._granted(who, answer)
                self._announce()
            else:
                puppeteer.tell(Refusal(message.limb, answer.reason, answer.holder).pack())
        elif isinstance(message, Release):
            puppeteer.granted.discard(message.limb)
            if self._troupe.release(message.limb, who, message.epoch, now):
                self._settle(now)
                self._announce()
        elif isinstance(message, Alive):
            self._troupe.alive(who, message.limbs, now)
            holders = self._troupe.troupe.holders()
            for limb in set(message.limbs):
                if limb >= len(holders) or holders[limb] != who:
                    puppeteer.lost(limb, now)
        elif isinstance(message, Ask):
            if self._troupe.ask(message.limb, who, message.wanted, now):
                self._announce()
        elif isinstance(message, Input):
            given = Given(message.limb, message.kind, message.epoch, message.sequence, message.sampled, message.values)
            outcome = self._troupe.input(who, given, now)
            self._tally.inputs[outcome.value] += 1
            if outcome in (Outcome.REACH, Outcome.OWNER):
                puppeteer.notice(message.limb, outcome.value, now)
            if outcome is Outcome.OWNER:
                puppeteer.lost(message.limb, now)

    def _granted(self, who: str, grant: Granted) -> None:
        if (puppeteer := self.puppeteers.get(who)) is not None:
            puppeteer.granted.add(grant.limb)
            puppeteer.tell(Grant(grant.limb, grant.epoch).pack())
        self._engaged.set()

    def _settle(self, now: int) -> bool:
        """Limbs that became free go to who asked for them; whether asks have changed."""
        grants, changed = self._troupe.settle(now)
        for who, grant in grants:
            self._granted(who, grant)
        self._tally.hand_overs += len(grants)
        return changed

    def _set(self, motion: StoredMotion) -> None:
        self._poses = Poses(motion, self._timelines)

    def _put(self, state: TimelineState) -> TimelineState:
        self._timelines.put(state)
        self.log.timeline(state)
        self._bus.publish(f"session.{self.id}.timeline", state.pack())
        return state

    def _announce(self) -> None:
        self.seen = clock()
        packed = self.presence.pack()
        self._bus.publish(f"session.{self.id}.presence", packed)
        for puppeteer in self.puppeteers:
            puppeteer.tell(packed)

    async def _state(self, _: bytes) -> bytes:
        packed: bytes = msgpack.packb([self.timeline.pack(), self.presence.pack(), self._overlay])
        return packed

    def _on_viewers(self, message: bytes) -> None:
        replica, count = msgpack.unpackb(message)
        self._viewers[replica] = count
        if count == 0:
            del self._viewers[replica]
        self._recount()

    def _recount(self) -> None:
        """Tell how many watch, now or before long: each replica counts for itself, and each count goes to everybody."""
        if self._counting is None:
            self._announce()
            told = self._viewers.copy()
            self._counting = asyncio.get_running_loop().call_later(COUNTED, self._count_again, told)

    def _count_again(self, told: dict[str, int]) -> None:
        self._counting = None
        if told != self._viewers:
            self._recount()

    async def _run(self) -> None:
        while True:
            await self._engaged.wait()
            self._engaged.clear()
            frame = self._frame_at(clock()) + 1
            await self._poses.prepare(self._time(frame) + LEAD)
            for before in (frame - 2, frame - 1):
                due = self._time(before) + LEAD
                if (poses := self._poses.at(due, FRAME)) is not None:
                    self._troupe.see(poses, due, self._time(before))
            pace, late = Pace(), 0
            while self._frames(range(frame if self._every_frame(pace) else frame + FRAMES - 1, frame + FRAMES), late):
                # a stage that was kept from working goes on from where it should be, in step with the others
                frame = max(frame + FRAMES, self._frame_at(clock()) - LONGEST_PAUSE)
                planned = self._time(frame + FRAMES - 1)
                await asyncio.sleep((planned - clock()) * 1e-6)
                late = clock() - planned
                pace.late(late)
                self._tally.late.add(max(late, 0) * 1e-6)
                await self._poses.prepare(self._time(frame) + LEAD)

    def _every_frame(self, pace: Pace) -> bool:
        """Whether the next message has all its frames: of a limb that is held, or moved as hands move, the last is
        enough, as viewers show what lies between."""
        return pace.full and self._troupe.troupe.lively

    def _time(self, frame: int) -> int:
        """The clock time of a frame: no two stages of a process work at the same instants."""
        return frame * FRAME + self._phase

    def _frame_at(self, now: int) -> int:
        return (now - self._phase) // FRAME

    def _frames(self, frames: range, late: int = 0) -> bool:
        """Publish what lies over the dance in some frames, each due `LEAD` after its time; whether any limb is
        pulled. It is `late` by so many microseconds, in which nobody could be heard: they are not taken for silence."""
        now, begun = clock(), time.perf_counter()
        lost = self._troupe.expire(now - self._deafness.late(late, now))
        for limb, holder in lost:
            if (puppeteer := self.puppeteers.get(holder)) is not None:
                puppeteer.lost(limb, now)
        if self._settle(now) or lost:
            self._announce()
        shown: list[Laid] = []
        for frame in frames:
            due = self._time(frame) + LEAD
            poses = self._poses.at(due, FRAME)
            shown.append(self._troupe.overlay(poses, due, self._time(frame)) if poses is not None else {})
        self._sequence += 1
        message = _overlay(self._sequence, self._time(frames[-1]) + LEAD, shown)
        self._overlay = message if shown[-1] else None
        self._tally.solving.add(time.perf_counter() - begun)
        self._bus.publish(f"session.{self.id}.overlay", message)
        return not self._troupe.troupe.at_rest


def troupe_of(motion: StoredMotion) -> Troupe:
    """The puppets for a motion; takes a tenth of a second."""
    return Troupe(_figures(motion))


def _figures(motion: StoredMotion) -> list[Figure]:
    return [dance.track.figure for dance in motion.dances]


def _overlay(sequence: int, due: int, shown: list[Laid]) -> bytes:
    """The message of some frames: those of the end that have the limbs of the last."""
    last = shown[-1].keys()
    frames: list[dict[int, tuple[int, ...]]] = []
    for laid in reversed(shown):
        if laid.keys() != last:
            break
        frames.append({limb: pack_joints(joints) for limb, joints in laid.items()})
    if not last:
        return Overlay(sequence, due, {}).pack()
    return Overlay(sequence, due, frames[0], tuple(reversed(frames[1:]))).pack()
