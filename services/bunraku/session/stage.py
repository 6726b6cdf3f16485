"""One session: timeline, puppeteers, and the overlay of their limbs (paper 5).

The stage publishes on the bus, on `session.{id}.`: `timeline` (message 4), `presence` (6), `overlay` (5), `pulls` (17),
`turn`, and `appear` when it takes over a session of another replica or is connected to the bus again. It subscribes to
`viewers` and `crowd` and responds to `state`. Overlays are computed for the time when they are due, `OVERLAY_LEAD_US`
ahead of now, so that every viewer can show them on time.
"""

from __future__ import annotations

import asyncio
import contextlib
import secrets
import time
from collections.abc import Callable, Mapping

import msgpack

from bunraku.codec.container import StoredMotion
from bunraku.marionette.marionettes import Marionettes, OverlayJoints
from bunraku.marionette.ownership import InputOutcome, LimbGrant, LimbInput, LimbRefusal
from bunraku.marionette.solver.limb_solver import PYTHON_SOLVER, LimbSolver
from bunraku.messaging.bus import Bus, Subscription
from bunraku.motion.placement import Placement
from bunraku.motion.skeleton import Figure
from bunraku.playout import timeline
from bunraku.playout.block_store import Pose
from bunraku.playout.overlay_buffer import pack_overlay
from bunraku.playout.performance import SampleOutcome
from bunraku.playout.session_log import SessionLog
from bunraku.session.control.bond_control import BondControl
from bunraku.session.control.crowd_control import CrowdControl
from bunraku.session.control.prop_control import PropControl
from bunraku.session.counters import SessionCounters
from bunraku.session.frame_rate import FrameRateControl
from bunraku.session.live.cast import Cast
from bunraku.session.live.live_performers import LivePerformers
from bunraku.session.pose_cache import PoseCache
from bunraku.session.presence import PresencePublisher
from bunraku.session.puppeteer_roster import Puppeteer, PuppeteerRoster
from bunraku.session.schema import SessionEdit
from bunraku.session.session_start import Fittings, SessionStart
from bunraku.session.stall import EventLoopStallCompensation
from bunraku.wire import messages
from bunraku.wire.live import Sample
from bunraku.wire.messages import (
    Alive,
    Ask,
    Bond,
    Claim,
    Grant,
    Input,
    Presence,
    Put,
    Refusal,
    Release,
    TimelineState,
    Welcome,
)
from bunraku.wire.overlay import Overlay
from bunraku.wire.prop import Prop

OVERLAY_LEAD_US = 60_000
"""Lead time of overlays: a message every two frames, and the latency to a viewer near by."""
EDIT_LEAD_US = 100_000
"""Lead time of edits of the timeline."""
FRAME_INTERVAL_US = Overlay.FRAME_INTERVAL_US
FRAMES_PER_MESSAGE = 2
"""Frames of one message: packets, not bytes, fill a constrained link."""
MAX_CATCH_UP_FRAMES = 6
"""Frames published late after a stall; earlier ones are skipped."""


class Stage:
    """A motion on a shared timeline, and the puppeteers who control its limbs."""

    def __init__(
        self,
        start: SessionStart,
        bus: Bus,
        clock: Callable[[], int],
        counters: SessionCounters | None = None,
        solver: LimbSolver = PYTHON_SOLVER,
    ) -> None:
        """Open the session's subjects on the bus and start its task.

        `clock` returns microseconds; `counters` are shared by all stages of a replica. Creating the marionettes takes a
        tenth of a second unless `load_bend_tables` was called for the motion.
        """
        self.id = start.id
        self.created = start.created_us
        self.subject = start.subject
        self._bus = bus
        self._clock = clock
        self._counters = counters or SessionCounters()
        self._timelines = timeline.TimelineHistory()
        self._timelines.put(start.timeline)
        self.puppeteers = PuppeteerRoster()
        self.presence_publisher = PresencePublisher(self._send_presence, clock)
        self._has_work = asyncio.Event()
        self._stall_compensation = EventLoopStallCompensation()
        self._sequence = 0
        self._phase_us = secrets.randbelow(FRAMES_PER_MESSAGE * FRAME_INTERVAL_US)
        self._last_overlay: bytes | None = None
        self.cast = start.cast
        self.live = LivePerformers()
        self.log = SessionLog()
        self.log.add_timeline(self.timeline)
        self._marionettes = Marionettes(_performer_figures(start.motion), solver=solver)
        self._ownership = self._marionettes.ownership
        self._bonds = BondControl(self._ownership, self.puppeteers)
        self.crowd = CrowdControl(self._ownership, lambda kind, data: bus.publish(f"session.{start.id}.{kind}", data))
        self.crowd.set_policies(start.fittings.crowd, clock())
        self.props = PropControl(start.fittings.props)
        self._set_motion(start.motion)
        subject = f"session.{start.id}"
        self._subscriptions: list[Subscription] = [
            bus.serve(f"{subject}.state", self._answer_state),
            bus.subscribe(f"{subject}.viewers", self._receive_viewer_count),
            bus.subscribe(f"{subject}.crowd", self._receive_crowd),
        ]
        self._tick_task = asyncio.create_task(self._run_ticks(), name=f"stage {start.id}")

    async def close(self) -> None:
        """Stop the stage; its puppeteers receive nothing more."""
        self.presence_publisher.close()
        self._tick_task.cancel()
        with contextlib.suppress(asyncio.CancelledError):
            await self._tick_task
        for subscription in self._subscriptions:
            subscription.unsubscribe()

    @property
    def timeline(self) -> TimelineState:
        """Newest timeline."""
        newest = self._timelines.newest
        assert newest is not None
        return newest

    def use_solver(self, solver: LimbSolver) -> None:
        """Solve limbs with another solver from the next frame on."""
        self._marionettes.use_solver(solver)

    def announce(self) -> None:
        """Publish the whole state, as others may have missed messages, and let them publish theirs again.

        Called after a take-over, when no limb is held any more, and after each reconnection to the bus.
        """
        self._bus.publish(f"session.{self.id}.appear", b"")
        self._bus.publish(f"session.{self.id}.timeline", self.timeline.pack())
        self.presence_publisher.publish()
        if self._last_overlay is None:
            self._sequence += 1
            no_limb = Overlay(self._sequence, self._clock() + OVERLAY_LEAD_US, {})
            self._bus.publish(f"session.{self.id}.overlay", no_limb.pack())

    @property
    def participant_count(self) -> int:
        """Number of viewers and puppeteers."""
        return self.presence_publisher.viewer_count + len(self.puppeteers)

    @property
    def last_active_us(self) -> int:
        """Clock time of the last change of viewers, puppeteers or limbs."""
        return self.presence_publisher.last_change_us

    def is_idle(self, now: int, duration_us: int) -> bool:
        """Return whether the session has had neither viewers, puppeteers nor performers for `duration_us`."""
        return self.participant_count == 0 and not self.cast.members and now - self.last_active_us >= duration_us

    @property
    def holders(self) -> tuple[str | None, ...]:
        """Holder's id of each limb, or None."""
        return self._ownership.holders()

    @property
    def presence(self) -> Presence:
        """Viewer count, puppeteers, limb holders, requests for limbs, bonds, open limbs and props."""
        puppeteers = [{"id": p.id, "name": p.name, "colour": p.colour} for p in self.puppeteers]
        asks = [list(limb) for limb in self._ownership.asks()]
        live = self.live.presence() or None
        bonds = [list(pair) for pair in self._ownership.bonds] or None
        crowd = self.crowd.presence() or None
        viewers = self.presence_publisher.viewer_count
        props = self.props.presence() or None
        return Presence(viewers, puppeteers, list(self.holders), asks, live, bonds, crowd, props)

    def plan_edit(self, edit: SessionEdit, motion: StoredMotion | None) -> TimelineState | None:
        """Return the timeline after an edit, due `EDIT_LEAD_US` from now; None if the edit changes nothing.

        A new `motion` begins at its start. Save the timeline, then pass it to `apply_edit`.
        """
        due, state = self._clock() + EDIT_LEAD_US, self.timeline
        if motion is not None:
            state = timeline.change_motion(state, due, motion.id, motion.first_track.duration_us)
        if (edit.playing, edit.position, edit.loop) != (None, None, None):
            state = timeline.edit(state, due, playing=edit.playing, position=edit.position, loop=edit.loop)
        return state if state is not self.timeline else None

    def apply_edit(self, state: TimelineState, motion: StoredMotion | None, cast: Cast) -> None:
        """Publish a timeline of `plan_edit`, and change the motion for everyone; limbs stay held.

        `motion` is that of the `cast`. Call `load_bend_tables` for it before, as its first arm takes a tenth of a
        second.
        """
        before, live_before = self.holders, self.live.presence()
        if motion is not None:
            self.cast = cast
            self._change_motion(motion)
        self._publish_timeline(state)
        if len(self.holders) != len(before) or self.live.presence() != live_before:
            self.presence_publisher.publish()

    def change_cast(self, cast: Cast) -> None:
        """Show other live performers on the present motion."""
        self.cast = cast
        self.live.assign(cast, self._motion)
        self.presence_publisher.publish()

    def _change_motion(self, motion: StoredMotion) -> None:
        now = self._clock()
        for limb, holder in self._marionettes.set_figures(_performer_figures(motion)):
            if (puppeteer := self.puppeteers.get(holder)) is not None:
                puppeteer.send_limb_lost(limb, now)
        self.props.drop_beyond(len(self.holders))
        self._set_motion(motion)

    def join(
        self, puppeteer_id: str, name: str, send: Callable[[bytes], None], subject: str | None = None
    ) -> Puppeteer:
        """Add a puppeteer, whose messages are passed to `send`; raises `SessionFull`.

        `subject` is that of the puppeteer's token, None without access control.
        """
        puppeteer = self.puppeteers.join(puppeteer_id, name, send, self._clock(), subject)
        puppeteer.send(Welcome(puppeteer.id, puppeteer.colour, OVERLAY_LEAD_US).pack())
        self.presence_publisher.publish()
        return puppeteer

    def leave(self, puppeteer: Puppeteer) -> None:
        """Remove a puppeteer, whose limbs go to the puppeteers who asked for them, or return to the motion."""
        self.puppeteers.leave(puppeteer)
        now = self._clock()
        self._ownership.leave(puppeteer.id, now)
        self._bonds.report_ended()
        self._grant_free_limbs(now)
        self.presence_publisher.publish()

    def receive(self, puppeteer: Puppeteer, message: messages.Message | None) -> None:
        """Apply a message of a puppeteer's controller."""
        now = self._clock()
        if isinstance(message, Claim):
            answer = self._ownership.claim(message.limb, puppeteer.id, now)
            if isinstance(answer, LimbRefusal):
                puppeteer.send(Refusal(message.limb, answer.reason, answer.holder).pack())
            else:
                self._send_grant(puppeteer.id, answer)
                self.presence_publisher.publish()
        elif isinstance(message, Release):
            # a release that crossed a newer grant does not give that one up
            if puppeteer.granted_epochs.get(message.limb) == message.epoch:
                del puppeteer.granted_epochs[message.limb]
            if self._ownership.release(message.limb, puppeteer.id, message.epoch, now):
                self._bonds.report_ended()
                self._grant_free_limbs(now)
                self.presence_publisher.publish()
        elif isinstance(message, Alive):
            self._ownership.keep_alive(puppeteer.id, message.limbs, now)
            holders = self.holders
            for limb in set(message.limbs):
                if limb >= len(holders) or holders[limb] != puppeteer.id:
                    puppeteer.send_limb_lost(limb, now)
        elif isinstance(message, Ask):
            if message.wanted and self._asks_under_another_name(puppeteer, message.limb):
                return
            if self._ownership.ask(message.limb, puppeteer.id, message.wanted, now):
                self.presence_publisher.publish()
        elif isinstance(message, Bond):
            if self._bonds.receive(puppeteer, message, now):
                self.presence_publisher.publish()
        elif isinstance(message, Put):
            if self.props.receive(puppeteer, message, self.holders):
                self.presence_publisher.publish()
        elif isinstance(message, Input):
            self._receive_input(puppeteer, message, now)

    def receive_sample(self, performer_id: str, sample: Sample) -> SampleOutcome | None:
        """Apply a sample of a live performer; None if there is no such performer."""
        performer = self.live.find(performer_id)
        if performer is None:
            return None
        self._has_work.set()
        return performer.receive(sample, self._clock())

    def _asks_under_another_name(self, puppeteer: Puppeteer, limb: int) -> bool:
        """Return whether another puppeteer of the same subject asks for a limb: each subject has one place."""
        asks = self._ownership.asks()
        others = map(self.puppeteers.get, asks[limb] if 0 <= limb < len(asks) else ())
        return puppeteer.subject is not None and any(
            other is not None and other is not puppeteer and other.subject == puppeteer.subject for other in others
        )

    def _receive_input(self, puppeteer: Puppeteer, message: Input, now: int) -> None:
        limb_input = LimbInput(
            message.limb, message.kind, message.epoch, message.sequence, message.sampled, message.values
        )
        outcome = self._ownership.apply_input(puppeteer.id, limb_input, now)
        self._counters.inputs[outcome.value] += 1
        if outcome in (InputOutcome.CLAMPED, InputOutcome.NOT_OWNER):
            puppeteer.send_notice(message.limb, outcome.value, now)
        if outcome is InputOutcome.NOT_OWNER:
            puppeteer.send_limb_lost(message.limb, now)

    def _send_grant(self, puppeteer_id: str, grant: LimbGrant) -> None:
        if (puppeteer := self.puppeteers.get(puppeteer_id)) is not None:
            puppeteer.granted_epochs[grant.limb] = grant.epoch
            puppeteer.send(Grant(grant.limb, grant.epoch).pack())
        self._has_work.set()

    def _grant_free_limbs(self, now: int) -> bool:
        """Grant free limbs to the puppeteers who asked for them; return whether requests have changed."""
        grants, changed = self._ownership.grant_free_limbs(now)
        for puppeteer_id, grant in grants:
            self._send_grant(puppeteer_id, grant)
        self._counters.hand_overs += len(grants)
        return changed

    def _set_motion(self, motion: StoredMotion) -> None:
        self._motion = motion
        self._pose_cache = PoseCache(motion, self._timelines)
        self.live.assign(self.cast, motion)

    def _publish_timeline(self, state: TimelineState) -> None:
        self._timelines.put(state)
        self.log.add_timeline(state)
        self._bus.publish(f"session.{self.id}.timeline", state.pack())

    def _send_presence(self) -> None:
        packed = self.presence.pack()
        self.log.add_props(self._clock(), self.props.all)
        self._bus.publish(f"session.{self.id}.presence", packed)
        for puppeteer in self.puppeteers:
            puppeteer.send(packed)

    async def _answer_state(self, _: bytes) -> bytes:
        packed: bytes = msgpack.packb([self.timeline.pack(), self.presence.pack(), self._last_overlay])
        return packed

    def _receive_viewer_count(self, message: bytes) -> None:
        self.presence_publisher.report_viewers(*msgpack.unpackb(message)[:2])

    @property
    def fittings(self) -> Fittings:
        """Open limbs and props."""
        return Fittings(self.crowd.policies, self.props.all)

    def plan_props(self, kinds: Mapping[int, str]) -> dict[int, Prop]:
        """Return the props of these kinds, by number; new ones lie before the first performer. Pass them to `fit`."""
        performer = self._motion.performers[0]
        x, z, turn = performer.placement
        return self.props.plan(kinds, Placement(x, z, turn + performer.front))

    def fit(self, fittings: Fittings) -> None:
        """Open and close limbs to the crowd, and bring and remove props; a prop that stays, stays where it is now."""
        has_changes = self.crowd.set_policies(fittings.crowd, self._clock())
        if self.props.bring(fittings.props) or has_changes:
            self.presence_publisher.publish()

    def _receive_crowd(self, message: bytes) -> None:
        now = self._clock()
        if self.crowd.receive(message, now) and self.crowd.apply(now):
            self._has_work.set()
            self.presence_publisher.publish()

    async def _run_ticks(self) -> None:
        while True:
            await self._has_work.wait()
            self._has_work.clear()
            frame = self._frame_at(self._clock()) + 1
            await self._pose_cache.decode_blocks(self._frame_time_us(frame) + OVERLAY_LEAD_US)
            for before in (frame - 2, frame - 1):
                due = self._frame_time_us(before) + OVERLAY_LEAD_US
                if (poses := self._poses_at(due, self.live.poses_at(self._frame_time_us(before)))) is not None:
                    self._marionettes.observe_poses(poses, self._frame_time_us(before))
            frame_rate, lateness_us = FrameRateControl(), 0
            while self._publish_frames(
                range(
                    frame if self._needs_every_frame(frame_rate) else frame + FRAMES_PER_MESSAGE - 1,
                    frame + FRAMES_PER_MESSAGE,
                ),
                lateness_us,
            ):
                # after a stall, continue with the current frame, in step with the timeline
                frame = max(frame + FRAMES_PER_MESSAGE, self._frame_at(self._clock()) - MAX_CATCH_UP_FRAMES)
                planned = self._frame_time_us(frame + FRAMES_PER_MESSAGE - 1)
                await asyncio.sleep((planned - self._clock()) * 1e-6)
                lateness_us = self._clock() - planned
                frame_rate.record_lateness(lateness_us)
                self._counters.tick_lateness_s.observe(max(lateness_us, 0) * 1e-6)
                await self._pose_cache.decode_blocks(self._frame_time_us(frame) + OVERLAY_LEAD_US)

    def _needs_every_frame(self, frame_rate: FrameRateControl) -> bool:
        """Return whether the next message needs all its frames.

        For a limb that is still or moves slowly the last frame is enough, because viewers interpolate.
        """
        return frame_rate.is_full_rate and (self._marionettes.needs_full_rate or self.live.is_shown)

    def _frame_time_us(self, frame: int) -> int:
        """Return the clock time of a frame; the random phase spreads the stages of a process over time."""
        return frame * FRAME_INTERVAL_US + self._phase_us

    def _frame_at(self, now: int) -> int:
        return (now - self._phase_us) // FRAME_INTERVAL_US

    def _publish_frames(self, frames: range, lateness_us: int = 0) -> bool:
        """Publish the overlay of some frames, each due `OVERLAY_LEAD_US` after its time.

        Returns whether more frames follow. `lateness_us` is the delay of this call, in which no message could be
        received: it does not count as silence of a puppeteer.
        """
        now, begin_s = self._clock(), time.perf_counter()
        lost = self._ownership.expire(now - self._stall_compensation.compensate(lateness_us, now))
        for limb, holder in lost:
            if (puppeteer := self.puppeteers.get(holder)) is not None:
                puppeteer.send_limb_lost(limb, now)
        has_changes = self.crowd.apply(now)
        has_changes |= self._bonds.report_ended()
        if self._grant_free_limbs(now) or lost or has_changes:
            self.presence_publisher.publish()
        frame_overlays: list[OverlayJoints] = []
        live_frames: list[dict[int, Pose]] = []
        for frame in frames:
            due = self._frame_time_us(frame) + OVERLAY_LEAD_US
            live_frames.append(self.live.poses_at(self._frame_time_us(frame)))
            poses = self._poses_at(due, live_frames[-1])
            overlay = self._marionettes.compute_overlay(poses, self._frame_time_us(frame)) if poses else {}
            frame_overlays.append(overlay)
        due = self._frame_time_us(frames[-1]) + OVERLAY_LEAD_US
        if (live := self.live.pack(due, self._frame_time_us(frames[-1]), live_frames)) is not None:
            self.log.add_message(due, live)
            self._bus.publish(f"session.{self.id}.live", live)
        if not self._ownership.is_at_rest or self._last_overlay is not None:
            self._sequence += 1
            message = pack_overlay(self._sequence, due, frame_overlays)
            self._last_overlay = message if frame_overlays[-1] else None
            self.log.add_message(due, message)
            self._bus.publish(f"session.{self.id}.overlay", message)
        self._counters.tick_duration_s.observe(time.perf_counter() - begin_s)
        # the first samples are shown only after their delay
        return not self._ownership.is_at_rest or self.live.is_shown or self.live.has_unshown_samples(now)

    def _poses_at(self, due: int, live: Mapping[int, Pose]) -> tuple[Pose, ...] | None:
        """Return the pose of each performer on the stage at clock time `due`, those of live ones as given."""
        poses = self._pose_cache.poses_at(due, FRAME_INTERVAL_US)
        if not live or poses is None:
            return poses
        performers = self._motion.performers
        return tuple(
            performers[number].placement.apply(*live[number]) if number in live else pose
            for number, pose in enumerate(poses)
        )


def load_bend_tables(motion: StoredMotion) -> None:
    """Build the bend tables of a motion's performers; takes a tenth of a second for each new arm."""
    Marionettes(_performer_figures(motion))


def _performer_figures(motion: StoredMotion) -> list[Figure]:
    return [performer.track.figure for performer in motion.performers]
