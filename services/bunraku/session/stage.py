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

from bunraku.codec.container import StoredMotion
from bunraku.marionette.input_log import InputLog, LoggedMarionettes
from bunraku.marionette.marionettes import Marionettes, OverlayJoints
from bunraku.marionette.ownership import InputOutcome
from bunraku.marionette.ownership import LimbGrant as Granted
from bunraku.marionette.ownership import LimbInput as Given
from bunraku.messaging.bus import Bus, Subscription
from bunraku.motion.skeleton import Figure
from bunraku.playout import timeline
from bunraku.playout.overlay_buffer import pack_joints
from bunraku.runtime.clock import clock
from bunraku.session.counters import SessionCounters
from bunraku.session.frame_rate import FrameRateControl
from bunraku.session.pose_cache import PoseCache
from bunraku.session.puppeteer_roster import Puppeteer, PuppeteerRoster
from bunraku.session.stall import EventLoopStallCompensation
from bunraku.wire import messages
from bunraku.wire.messages import Alive, Ask, Claim, Grant, Input, Presence, Refusal, Release, TimelineState, Welcome
from bunraku.wire.overlay import Overlay

OVERLAY_LEAD_US = 60_000
"""How far ahead of now overlays are due, microseconds: a message every two frames, and its way to a viewer near by."""
EDIT_LEAD_US = 100_000
"""How far ahead of now edits of the timeline are due, microseconds."""
FRAME_INTERVAL_US = Overlay.FRAME_INTERVAL_US
FRAMES_PER_MESSAGE = 2
"""Frames in one message: on a narrow line packets count, not bytes."""
MAX_CATCH_UP_FRAMES = 6
"""Frames: a stage that was kept from working for longer leaves them out."""
VIEWER_COUNT_INTERVAL_S = 0.5
"""Seconds between two tellings of how many watch."""


class Stage:
    """A motion on a shared timeline, and those who pull at it."""

    def __init__(
        self,
        session: str,
        motion: StoredMotion,
        marionettes: Marionettes,
        bus: Bus,
        state: TimelineState,
        created: int,
        counters: SessionCounters | None = None,
    ) -> None:
        """`troupe` is of the motion's figures; the caller builds it, which takes a tenth of a second. `state` is of
        this motion; `created` a clock time, microseconds; `tally` counts what goes on at all stages of a replica."""
        self.id = session
        self.created = created
        self._bus = bus
        self._counters = counters or SessionCounters()
        self._timelines = timeline.TimelineHistory()
        self._timelines.put(state)
        self.puppeteers = PuppeteerRoster()
        self._viewers_by_replica: dict[str, int] = {}
        self._viewer_count_timer: asyncio.TimerHandle | None = None
        self._has_grants = asyncio.Event()
        self._stall_compensation = EventLoopStallCompensation()
        self._sequence = 0
        self._phase_us = secrets.randbelow(FRAMES_PER_MESSAGE * FRAME_INTERVAL_US)
        self._last_overlay: bytes | None = None
        self.last_active_us = clock()
        self.log = InputLog()
        self.log.add_timeline(self.timeline)
        self._marionettes = LoggedMarionettes(marionettes, motion.id, self.log)
        self._set_motion(motion)
        subject = f"session.{session}"
        self._subscriptions: list[Subscription] = [
            bus.serve(f"{subject}.state", self._answer_state),
            bus.subscribe(f"{subject}.viewers", self._receive_viewer_count),
        ]
        self._tick_task = asyncio.create_task(self._run_ticks(), name=f"stage {session}")

    async def close(self) -> None:
        """End the session; its puppeteers are told nothing more."""
        if self._viewer_count_timer is not None:
            self._viewer_count_timer.cancel()
        self._tick_task.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await self._tick_task
        for subscription in self._subscriptions:
            subscription.unsubscribe()

    @property
    def timeline(self) -> TimelineState:
        """The newest timeline."""
        newest = self._timelines.newest
        assert newest is not None
        return newest

    def announce_takeover(self) -> None:
        """Tell those who watched when the session was another replica's where it goes on: nobody holds a limb."""
        self._bus.publish(f"session.{self.id}.appear", b"")
        self._bus.publish(f"session.{self.id}.timeline", self.timeline.pack())
        self._publish_presence()
        self._sequence += 1
        self._bus.publish(f"session.{self.id}.overlay", Overlay(self._sequence, clock() + OVERLAY_LEAD_US, {}).pack())

    @property
    def participant_count(self) -> int:
        """Viewers and puppeteers."""
        return sum(self._viewers_by_replica.values()) + len(self.puppeteers)

    @property
    def holders(self) -> tuple[str | None, ...]:
        """The holder's id of each limb, or None."""
        return self._marionettes.marionettes.holders()

    @property
    def presence(self) -> Presence:
        """Who is here, who holds what, and who asks for it."""
        puppeteers = [{"id": p.id, "name": p.name, "colour": p.colour} for p in self.puppeteers]
        troupe = self._marionettes.marionettes
        asks = [list(limb) for limb in troupe.asks()]
        return Presence(sum(self._viewers_by_replica.values()), puppeteers, list(troupe.holders()), asks)

    def edit_timeline(self, *, playing: bool | None, position: int | None, loop: bool | None) -> TimelineState:
        """Edit the timeline for everyone, `EDIT_LEAD` from now."""
        due = clock() + EDIT_LEAD_US
        return self._publish_timeline(timeline.edit(self.timeline, due, playing=playing, position=position, loop=loop))

    async def change_motion(self, motion: StoredMotion) -> TimelineState:
        """Another motion for everyone, from its start; limbs stay in the hands they are in."""
        # the first arm of its proportions takes a tenth of a second; the loop goes on meanwhile
        await asyncio.to_thread(make_marionettes, motion)
        now, before = clock(), self.holders
        for limb, holder in self._marionettes.set_figures(_performer_figures(motion), motion.id, now):
            if (puppeteer := self.puppeteers.get(holder)) is not None:
                puppeteer.send_limb_lost(limb, now)
        self._set_motion(motion)
        state = self._publish_timeline(
            timeline.change_motion(self.timeline, clock() + EDIT_LEAD_US, motion.id, motion.first_track.duration_us)
        )
        if len(self.holders) != len(before):
            self._publish_presence()
        return state

    def join(self, puppeteer_id: str, name: str, send: Callable[[bytes], None]) -> Puppeteer:
        """A puppeteer comes, of the id `who`, and is told what there is with `tell`; raises `Full`."""
        puppeteer = self.puppeteers.join(puppeteer_id, name, send, clock())
        puppeteer.send(Welcome(puppeteer.id, puppeteer.colour, OVERLAY_LEAD_US).pack())
        self._publish_presence()
        return puppeteer

    def leave(self, puppeteer: Puppeteer) -> None:
        """A puppeteer goes; what they held goes to who asked for it, or back to the dance."""
        self.puppeteers.leave(puppeteer)
        now = clock()
        self._marionettes.leave(puppeteer.id, now)
        self._grant_free_limbs(now)
        self._publish_presence()

    def receive(self, puppeteer: Puppeteer, message: messages.Message | None) -> None:
        """What a puppeteer's controller says."""
        now = clock()
        who = puppeteer.id
        if isinstance(message, Claim):
            answer = self._marionettes.claim(message.limb, who, now)
            if isinstance(answer, Granted):
                self._send_grant(who, answer)
                self._publish_presence()
            else:
                puppeteer.send(Refusal(message.limb, answer.reason, answer.holder).pack())
        elif isinstance(message, Release):
            puppeteer.granted_limbs.discard(message.limb)
            if self._marionettes.release(message.limb, who, message.epoch, now):
                self._grant_free_limbs(now)
                self._publish_presence()
        elif isinstance(message, Alive):
            self._marionettes.keep_alive(who, message.limbs, now)
            holders = self._marionettes.marionettes.holders()
            for limb in set(message.limbs):
                if limb >= len(holders) or holders[limb] != who:
                    puppeteer.send_limb_lost(limb, now)
        elif isinstance(message, Ask):
            if self._marionettes.ask(message.limb, who, message.wanted, now):
                self._publish_presence()
        elif isinstance(message, Input):
            given = Given(message.limb, message.kind, message.epoch, message.sequence, message.sampled, message.values)
            outcome = self._marionettes.apply_input(who, given, now)
            self._counters.inputs[outcome.value] += 1
            if outcome in (InputOutcome.CLAMPED, InputOutcome.NOT_OWNER):
                puppeteer.send_notice(message.limb, outcome.value, now)
            if outcome is InputOutcome.NOT_OWNER:
                puppeteer.send_limb_lost(message.limb, now)

    def _send_grant(self, puppeteer_id: str, grant: Granted) -> None:
        if (puppeteer := self.puppeteers.get(puppeteer_id)) is not None:
            puppeteer.granted_limbs.add(grant.limb)
            puppeteer.send(Grant(grant.limb, grant.epoch).pack())
        self._has_grants.set()

    def _grant_free_limbs(self, now: int) -> bool:
        """Limbs that became free go to who asked for them; whether asks have changed."""
        grants, changed = self._marionettes.grant_free_limbs(now)
        for who, grant in grants:
            self._send_grant(who, grant)
        self._counters.hand_overs += len(grants)
        return changed

    def _set_motion(self, motion: StoredMotion) -> None:
        self._pose_cache = PoseCache(motion, self._timelines)

    def _publish_timeline(self, state: TimelineState) -> TimelineState:
        self._timelines.put(state)
        self.log.add_timeline(state)
        self._bus.publish(f"session.{self.id}.timeline", state.pack())
        return state

    def _publish_presence(self) -> None:
        self.last_active_us = clock()
        packed = self.presence.pack()
        self._bus.publish(f"session.{self.id}.presence", packed)
        for puppeteer in self.puppeteers:
            puppeteer.send(packed)

    async def _answer_state(self, _: bytes) -> bytes:
        packed: bytes = msgpack.packb([self.timeline.pack(), self.presence.pack(), self._last_overlay])
        return packed

    def _receive_viewer_count(self, message: bytes) -> None:
        replica, count = msgpack.unpackb(message)
        self._viewers_by_replica[replica] = count
        if count == 0:
            del self._viewers_by_replica[replica]
        self._schedule_presence()

    def _schedule_presence(self) -> None:
        """Tell how many watch, now or before long: each replica counts for itself, and each count goes to everybody."""
        if self._viewer_count_timer is None:
            self._publish_presence()
            told = self._viewers_by_replica.copy()
            self._viewer_count_timer = asyncio.get_running_loop().call_later(
                VIEWER_COUNT_INTERVAL_S, self._publish_changed_count, told
            )

    def _publish_changed_count(self, published_counts: dict[str, int]) -> None:
        self._viewer_count_timer = None
        if published_counts != self._viewers_by_replica:
            self._schedule_presence()

    async def _run_ticks(self) -> None:
        while True:
            await self._has_grants.wait()
            self._has_grants.clear()
            frame = self._frame_at(clock()) + 1
            await self._pose_cache.decode_blocks(self._frame_time_us(frame) + OVERLAY_LEAD_US)
            for before in (frame - 2, frame - 1):
                due = self._frame_time_us(before) + OVERLAY_LEAD_US
                if (poses := self._pose_cache.poses_at(due, FRAME_INTERVAL_US)) is not None:
                    self._marionettes.observe_poses(poses, due, self._frame_time_us(before))
            pace, late = FrameRateControl(), 0
            while self._publish_frames(
                range(
                    frame if self._needs_every_frame(pace) else frame + FRAMES_PER_MESSAGE - 1,
                    frame + FRAMES_PER_MESSAGE,
                ),
                late,
            ):
                # a stage that was kept from working goes on from where it should be, in step with the others
                frame = max(frame + FRAMES_PER_MESSAGE, self._frame_at(clock()) - MAX_CATCH_UP_FRAMES)
                planned = self._frame_time_us(frame + FRAMES_PER_MESSAGE - 1)
                await asyncio.sleep((planned - clock()) * 1e-6)
                late = clock() - planned
                pace.record_lateness(late)
                self._counters.tick_lateness_s.observe(max(late, 0) * 1e-6)
                await self._pose_cache.decode_blocks(self._frame_time_us(frame) + OVERLAY_LEAD_US)

    def _needs_every_frame(self, frame_rate: FrameRateControl) -> bool:
        """Whether the next message has all its frames: of a limb that is held, or moved as hands move, the last is
        enough, as viewers show what lies between."""
        return frame_rate.is_full_rate and self._marionettes.marionettes.needs_full_rate

    def _frame_time_us(self, frame: int) -> int:
        """The clock time of a frame: no two stages of a process work at the same instants."""
        return frame * FRAME_INTERVAL_US + self._phase_us

    def _frame_at(self, now: int) -> int:
        return (now - self._phase_us) // FRAME_INTERVAL_US

    def _publish_frames(self, frames: range, lateness_us: int = 0) -> bool:
        """Publish what lies over the dance in some frames, each due `LEAD` after its time; whether any limb is
        pulled. It is `late` by so many microseconds, in which nobody could be heard: they are not taken for silence."""
        now, begun = clock(), time.perf_counter()
        lost = self._marionettes.expire(now - self._stall_compensation.compensate(lateness_us, now))
        for limb, holder in lost:
            if (puppeteer := self.puppeteers.get(holder)) is not None:
                puppeteer.send_limb_lost(limb, now)
        if self._grant_free_limbs(now) or lost:
            self._publish_presence()
        shown: list[OverlayJoints] = []
        for frame in frames:
            due = self._frame_time_us(frame) + OVERLAY_LEAD_US
            poses = self._pose_cache.poses_at(due, FRAME_INTERVAL_US)
            shown.append(
                self._marionettes.compute_overlay(poses, due, self._frame_time_us(frame)) if poses is not None else {}
            )
        self._sequence += 1
        message = _pack_overlay(self._sequence, self._frame_time_us(frames[-1]) + OVERLAY_LEAD_US, shown)
        self._last_overlay = message if shown[-1] else None
        self._counters.tick_duration_s.observe(time.perf_counter() - begun)
        self._bus.publish(f"session.{self.id}.overlay", message)
        return not self._marionettes.marionettes.is_at_rest


def make_marionettes(motion: StoredMotion) -> Marionettes:
    """The puppets for a motion; takes a tenth of a second."""
    return Marionettes(_performer_figures(motion))


def _performer_figures(motion: StoredMotion) -> list[Figure]:
    return [dance.track.figure for dance in motion.performers]


def _pack_overlay(sequence: int, due: int, frame_overlays: list[OverlayJoints]) -> bytes:
    """The message of some frames: those of the end that have the limbs of the last."""
    last = frame_overlays[-1].keys()
    frames: list[dict[int, tuple[int, ...]]] = []
    for laid in reversed(frame_overlays):
        if laid.keys() != last:
            break
        frames.append({limb: pack_joints(joints) for limb, joints in laid.items()})
    if not last:
        return Overlay(sequence, due, {}).pack()
    return Overlay(sequence, due, frames[0], tuple(reversed(frames[1:]))).pack()
