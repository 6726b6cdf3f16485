"""RPC endpoint of a stage on the bus, which every replica can reach.

On `session.{id}.` it responds to the requests `describe`, `edit`, `log`, `end` and `join` with MessagePack: the answer
as the API shows it, or `{"problem": ...}`. Puppeteers publish their messages on `said` as `[puppeteer, message]`; None
means that the puppeteer has left, and an empty message is a heartbeat. Messages to a puppeteer are published on
`told.{puppeteer}`; an empty one means that the stage does not know the puppeteer. Live performers have requests and
messages of their own (`bunraku.session.live.performer_endpoint`).
"""

from __future__ import annotations

import asyncio
import logging
import secrets
from collections.abc import Awaitable, Callable
from typing import Any, Protocol

import msgpack

from bunraku.codec.container import StoredMotion
from bunraku.http.token_bucket import KeyedTokenBuckets
from bunraku.messaging.bus import Subscription
from bunraku.messaging.recording_request import MAX_RECORDING_S
from bunraku.playout.overlay_buffer import OVERLAY_HOLD_US
from bunraku.playout.timeline import position_at
from bunraku.runtime.availability import BackendUnavailable
from bunraku.runtime.context import ServiceContext
from bunraku.runtime.input_scheduler import InputScheduler
from bunraku.runtime.problem import ProblemError
from bunraku.session.live.cast import EMPTY_CAST, Cast
from bunraku.session.live.cast_store import CastStore
from bunraku.session.live.performer_endpoint import PerformerEndpoint
from bunraku.session.puppeteer_input import PuppeteerInput
from bunraku.session.puppeteer_roster import SessionFull
from bunraku.session.schema import SessionEdit
from bunraku.session.session_start import Fittings
from bunraku.session.stage import EDIT_LEAD_US, Stage, load_bend_tables
from bunraku.wire.messages import TimelineState

PUPPETEER_HEARTBEAT_S = 2.0
"""Interval between the heartbeats that a replica sends for a puppeteer."""
PUPPETEER_TIMEOUT_US = 7_000_000
"""Silence after which a puppeteer is removed: the replica of the connection has died."""
VIEWER_COUNT_TIMEOUT_US = 17_000_000
"""Silence of a stream replica after which its viewers no longer count: it has died. It reports every 5 s."""
JOINS_PER_S, JOIN_BURST = 2.0, 32
"""Rate at which one subject may join a session, and the number of joins at once: every join is sent to all viewers."""

_log = logging.getLogger(__name__)


class StageOwner(Protocol):
    """Manager of the stages of a replica."""

    input_scheduler: InputScheduler
    """Turns of the puppeteers of all stages."""
    casts: CastStore
    """Motions of the casts of all stages."""

    def require_room(self, subject: str) -> None:
        """Raise `ProblemError` unless the replica can show another live performer of a subject."""

    async def load_cast(self, cast: Cast) -> StoredMotion:
        """Return the motion of a cast; raises `ProblemError`."""

    async def save_record(
        self, stage: Stage, state: TimelineState, cast: Cast, fittings: Fittings | None = None
    ) -> None:
        """Save a stage with its next timeline, cast and fittings, so that another replica can continue it."""

    async def end_session(self, session: str) -> None:
        """End a session."""


class StageEndpoint:
    """Endpoint of one stage."""

    def __init__(self, stage: Stage, context: ServiceContext, owner: StageOwner, revision: int) -> None:
        self.stage = stage
        self.revision = revision
        """Revision of the session's record in the key-value store."""
        self.record_lock = asyncio.Lock()
        """Lock of the record, held by the one request or task that changes it."""
        self._context = context
        self._clock = context.clock
        # each edit begins with the timeline of the one before it
        self._edit_lock = asyncio.Lock()
        self._owner = owner
        self._subject = f"session.{stage.id}"
        self._inputs: dict[str, PuppeteerInput] = {}
        self._join_rate = KeyedTokenBuckets(JOINS_PER_S, JOIN_BURST)
        self._performers = PerformerEndpoint(stage, context, self, owner)
        bus = context.bus
        operations: dict[str, Callable[[Any], Awaitable[Any]]] = {
            "describe": self._answer_describe,
            "edit": self._answer_edit,
            "log": self._answer_log,
            "end": self._answer_end,
            "join": self._answer_join,
            **self._performers.operations,
        }
        self._subscriptions: list[Subscription] = [
            bus.subscribe(f"{self._subject}.said", self._receive),
            *(
                bus.serve(f"{self._subject}.{operation}", self._make_responder(operation, handler))
                for operation, handler in operations.items()
            ),
        ]
        self._is_closed = False
        self._sweep_task = asyncio.create_task(self._expire_participants(), name=f"participants of {stage.id}")

    async def close(self) -> None:
        """Stop responding, disconnect the puppeteers and close the stage."""
        for subscription in self._subscriptions:
            subscription.unsubscribe()
        self._is_closed = True
        # not from the task itself, which closes the endpoint when it finds that the session is lost
        if asyncio.current_task() is not self._sweep_task:
            self._sweep_task.cancel()
            await asyncio.wait((self._sweep_task,))
        # its exception refers to this object: without the reference both are freed at once
        del self._sweep_task
        await self._performers.close()
        for puppeteer in self.stage.puppeteers:
            puppeteer.send(b"")
        await self.stage.close()

    def _make_responder(
        self, operation: str, handler: Callable[[Any], Awaitable[Any]]
    ) -> Callable[[bytes], Awaitable[bytes]]:
        async def respond(request: bytes) -> bytes:
            # `describe` runs for every request of a guest, to check the session's motion
            _log.log(
                logging.DEBUG if operation == "describe" else logging.INFO, "session %s: %s", self.stage.id, operation
            )
            try:
                answer = {"answer": await handler(msgpack.unpackb(request))}
            except ProblemError as error:
                answer = {"problem": error.to_dict()}
            packed: bytes = msgpack.packb(answer)
            return packed

        return respond

    async def _answer_describe(self, _: None) -> dict[str, Any]:
        return session_json(self.stage, self._clock())

    async def _answer_edit(self, values: dict[str, Any]) -> dict[str, Any]:
        edit = SessionEdit.model_validate(values)
        async with self._edit_lock:
            cast = self.stage.cast
            if edit.motion is not None and edit.motion != self.stage.timeline.motion:
                # live performers stay beside the performers of another motion
                cast = Cast(edit.motion, cast.members)
            await self._apply_edit(edit, cast)
        return session_json(self.stage, self._clock())

    async def change_motion(self, motion: str) -> None:
        """Save another motion, then show it."""
        async with self._edit_lock:
            await self._apply_edit(SessionEdit(), Cast(motion, self.stage.cast.members))

    async def change_cast(self, cast: Cast) -> None:
        """Save a cast, then show it; its motion goes on where it is."""
        async with self._edit_lock:
            if not cast.motion:
                # nothing else to play: the figure of the last performer stays, at rest
                await self._owner.save_record(self.stage, self.stage.timeline, EMPTY_CAST)
                self._performers.replace(self.stage.cast)
                self.stage.change_cast(EMPTY_CAST)
                return
            position = position_at(self.stage.timeline, self._clock() + EDIT_LEAD_US)
            await self._apply_edit(SessionEdit(position=position), cast)

    async def _apply_edit(self, edit: SessionEdit, cast: Cast) -> None:
        stage, motion = self.stage, None
        if cast.motion and cast.motion != stage.timeline.motion:
            motion = await self._owner.load_cast(cast)
            await asyncio.to_thread(load_bend_tables, motion)
        state = stage.plan_edit(edit, motion)
        fittings = Fittings(edit.open_limbs(stage.crowd.policies), stage.plan_props(edit.prop_kinds(stage.props.kinds)))
        # saved before it is shown: a server that takes over continues what viewers have seen
        await self._owner.save_record(stage, state or stage.timeline, cast, fittings)
        stage.fit(fittings)
        if state is not None:
            if motion is not None and stage.cast.members:
                self._performers.replace(stage.cast)
            stage.apply_edit(state, motion, cast)

    async def _answer_log(self, seconds: float | None) -> dict[str, Any]:
        stage, end = self.stage, self._clock()
        duration_s = seconds or min(stage.timeline.duration * 1e-6, MAX_RECORDING_S)
        name = f"{stage.id[:12]}-{secrets.token_hex(12)}"
        begin = max(end - round(duration_s * 1e6), stage.created)
        # what viewers saw at the begin may have ended just before
        await self._context.motion_store.put_log(name, stage.log.pack(begin - OVERLAY_HOLD_US))
        return {"log": name, "begin": begin, "end": end}

    async def _answer_end(self, _: None) -> None:
        self._performers.end_all()
        await self._owner.end_session(self.stage.id)
        await self._performers.remove_motions()

    async def _answer_join(self, values: list[Any]) -> dict[str, Any]:
        # replicas of earlier releases send no subject
        puppeteer_id, name, subject = (*values, None)[:3]
        if subject is not None and not self._join_rate.take(subject, self._clock() * 1e-6):
            raise ProblemError(429, "Too many joins", "this link joins too often", hint="try again in a second")
        try:
            puppeteer = self.stage.join(
                puppeteer_id,
                name,
                lambda message: self._context.bus.publish(f"{self._subject}.told.{puppeteer_id}", message),
                subject,
            )
        except SessionFull as error:
            raise ProblemError(503, "Full", str(error)) from None
        self._inputs[puppeteer_id] = PuppeteerInput(puppeteer, self.stage, self._owner.input_scheduler)
        return {"colour": puppeteer.colour}

    def _receive(self, message: bytes) -> None:
        puppeteer_id, packed = msgpack.unpackb(message)[:2]
        puppeteer = self.stage.puppeteers.get(puppeteer_id)
        if puppeteer is None:
            self._inputs.pop(puppeteer_id, None)
            if packed is not None:
                self._context.bus.publish(f"{self._subject}.told.{puppeteer_id}", b"")
            return
        puppeteer.last_heard_us = self._clock()
        if packed != b"" and (puppeteer_input := self._inputs.get(puppeteer_id)) is not None:
            puppeteer_input.add(packed)
        if packed is None:
            self._inputs.pop(puppeteer_id, None)

    async def _save_moves(self) -> None:
        """Save where puppeteers have put the props; if that fails, the next call tries again."""
        stage = self.stage
        if not stage.props.has_unsaved_moves:
            return
        try:
            async with self._edit_lock:
                await self._owner.save_record(stage, stage.timeline, stage.cast)
        except (ProblemError, BackendUnavailable) as error:
            stage.props.has_unsaved_moves = True
            _log.warning("session %s: the places of its props are not saved: %s", stage.id, error)

    async def _expire_participants(self) -> None:
        """Remove the puppeteers and viewers whose replica has died, and save moved props, until cancelled."""
        while True:
            begin = self._clock()
            await asyncio.sleep(PUPPETEER_HEARTBEAT_S)
            now = self._clock()
            # while the event loop was blocked, no heartbeat could be received
            stalled_us = max(now - begin - round(PUPPETEER_HEARTBEAT_S * 1e6), 0)
            self.stage.presence_publisher.expire_viewer_counts(VIEWER_COUNT_TIMEOUT_US, stalled_us)
            self._performers.expire(stalled_us)
            await self._performers.maintain()
            await self._save_moves()
            if self._is_closed:
                return
            for puppeteer in self.stage.puppeteers:
                puppeteer.last_heard_us += stalled_us
                if now - puppeteer.last_heard_us > PUPPETEER_TIMEOUT_US:
                    puppeteer.send(b"")
                    self.stage.leave(puppeteer)
                    self._inputs.pop(puppeteer.id, None)


def session_json(stage: Stage, now: int) -> dict[str, Any]:
    """Return a session as the API shows it at clock time `now`."""
    state, presence = stage.timeline, stage.presence
    return {
        "id": stage.id,
        "motion": state.motion,
        "base": (stage.cast.base if stage.cast.members else state.motion) or None,
        "playing": state.playing,
        "loop": state.loop,
        "position": position_at(state, now),
        "duration": state.duration,
        "epoch": state.epoch,
        "viewers": presence.viewers,
        "puppeteers": presence.puppeteers,
        "limbs": presence.limbs,
        "crowd": presence.crowd or [],
        "props": presence.props or [],
    }
