"""Live performers of one stage on the bus.

On `session.{id}.` the stage responds to `perform`, `performer`, `attach` and `unperform`. Connections publish on
`sample` `[performer, connection, message]`: a packed Sample, an empty message as a heartbeat, or None when they have
ended. On `performer.{performer}` they are told which connection is the performer's; an empty id means that the
performance has ended.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from typing import Any, Protocol

import msgpack

from bunraku.messaging.bus import Subscription
from bunraku.messaging.performance_request import PERFORMANCE_SUBJECT
from bunraku.runtime.availability import BackendUnavailable
from bunraku.runtime.context import ServiceContext
from bunraku.runtime.problem import ProblemError
from bunraku.session.live.cast import EMPTY_CAST, Cast, CastMember
from bunraku.session.live.cast_store import CastStore
from bunraku.session.stage import Stage
from bunraku.wire.live import Sample
from bunraku.wire.messages import unpack

RECONNECT_TIMEOUT_US = 30_000_000
"""Time without a connection after which a performance ends."""
REPLACED_LIFETIME_US = 60_000_000
"""Time for which viewers who join may still ask for the motion of a former cast."""
REFRESH_INTERVAL_US = 6 * 3_600_000_000
FLUSH_TIMEOUT_S = 3.0
"""Time in which the connection of an ended performer stores its last samples."""

_log = logging.getLogger(__name__)


class CastEditor(Protocol):
    """Editor of a stage's motion. Methods raise `ProblemError`."""

    async def change_cast(self, cast: Cast) -> None:
        """Save a cast, then show it."""

    async def change_motion(self, motion: str) -> None:
        """Save another motion, then show it."""


class PerformerOwner(Protocol):
    """Manager of the performers of a replica."""

    casts: CastStore
    """Motions of the casts of all stages."""

    def require_room(self, subject: str) -> None:
        """Raise `ProblemError` unless the replica can show another performer of a subject."""


@dataclass(slots=True)
class _Attachment:
    """Connection of a performer; `connection` is None before one was heard of."""

    last_heard_us: int
    connection: str | None = None
    has_left: asyncio.Event = field(default_factory=asyncio.Event)


class PerformerEndpoint:
    """Endpoint of the live performers of one stage."""

    def __init__(self, stage: Stage, context: ServiceContext, editor: CastEditor, owner: PerformerOwner) -> None:
        self._stage = stage
        self._context = context
        self._clock = context.clock
        self._editor = editor
        self._owner = owner
        self._casts = owner.casts
        self._refreshed_at = context.clock()
        # casts that are not shown any more, and since when
        self._replaced: list[tuple[int, Cast]] = []
        self._subject = f"session.{stage.id}"
        self._attachments: dict[str, _Attachment] = {}
        self._endings: dict[str, asyncio.Task[None]] = {}
        self._showings: set[asyncio.Task[None]] = set()
        self._is_vacant = False
        self._subscriptions: list[Subscription] = [
            context.bus.subscribe(f"{self._subject}.sample", self._receive),
            context.bus.subscribe(f"{self._subject}.performed", self._receive_motion),
        ]
        for member in stage.cast.members:
            self._attachments[member.id] = _Attachment(self._clock())

    @property
    def operations(self) -> dict[str, Callable[[Any], Awaitable[Any]]]:
        """Handlers of the requests."""
        return {
            "perform": self._answer_perform,
            "performer": self._answer_describe,
            "attach": self._answer_attach,
            "unperform": self._answer_end,
        }

    async def close(self) -> None:
        """Receive nothing more. The performers stay in the session's record."""
        for subscription in self._subscriptions:
            subscription.unsubscribe()
        tasks = [*self._endings.values(), *self._showings]
        for task in tasks:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        # the editor refers to this object: without the reference both are freed at once
        del self._editor

    def replace(self, cast: Cast) -> None:
        """Remove the motions of a cast that is not shown any more, once nobody asks for them."""
        self._replaced.append((self._clock(), cast))

    async def maintain(self) -> None:
        """Remove the motions of former casts, and refresh those of the present one."""
        now = self._clock()
        try:
            while self._replaced and now - self._replaced[0][0] > REPLACED_LIFETIME_US:
                await self._casts.remove(self._replaced[0][1], self._shown_cast)
                del self._replaced[0]
            if now - self._refreshed_at > REFRESH_INTERVAL_US:
                await self._casts.refresh(self._stage.cast)
                self._refreshed_at = now
        except (BackendUnavailable, ProblemError) as error:
            _log.warning("session %s: motions of its cast not maintained: %s; trying again", self._stage.id, error)

    async def remove_motions(self) -> None:
        """Remove the motions of all casts, as the session has ended."""
        with contextlib.suppress(BackendUnavailable, ProblemError):
            for _, cast in (*self._replaced, (0, self._stage.cast)):
                await self._casts.remove(cast, EMPTY_CAST)

    @property
    def _shown_cast(self) -> Cast:
        """The cast on the stage, also when its last performer has left and the figure is still there."""
        shown = self._stage.timeline.motion
        return next((cast for _, cast in self._replaced if cast.motion == shown), self._stage.cast)

    def expire(self, stalled_us: int) -> None:
        """End the performers without a connection; `stalled_us` is the time in which no message could be received."""
        now = self._clock()
        for performer, attachment in self._attachments.items():
            attachment.last_heard_us += stalled_us
            if now - attachment.last_heard_us > RECONNECT_TIMEOUT_US:
                self._end(performer)

    def end_all(self) -> None:
        """Tell all performers that their performance has ended, as the session ends."""
        for performer in self._attachments:
            self._tell(performer, "")

    async def _answer_perform(self, values: list[Any]) -> dict[str, Any]:
        (member,) = Cast.from_values(["", [values]]).members
        if self._stage.cast.find(member.id) is None:
            self._owner.require_room(member.subject)
            cast = self._stage.cast if self._stage.cast.members else Cast(self._stage.timeline.motion)
            self._attachments[member.id] = _Attachment(self._clock())
            try:
                await self._editor.change_cast(Cast(cast.base, (*cast.members, member)))
            except BaseException:
                del self._attachments[member.id]
                raise
        return await self._answer_describe(member.id)

    async def _answer_describe(self, performer: str) -> dict[str, Any]:
        member = self._require(performer)
        live = self._stage.live.find(performer)
        return {
            "id": member.id,
            "name": member.name,
            "fps": member.fps,
            "session": self._stage.id,
            "performer": self._stage.live.number_of(performer),
            "connected": self._attachments[performer].connection is not None,
            "delay": live.performance.delay_us(self._clock()) if live is not None else None,
            "samples": dict(live.outcomes) if live is not None else {},
        }

    async def _answer_attach(self, values: list[str]) -> None:
        performer, connection = values
        self._require(performer)
        self._attach(performer, connection)

    async def _answer_end(self, performer: str) -> None:
        self._require(performer)
        await asyncio.shield(self._end(performer))

    def _receive(self, packed: bytes) -> None:
        performer, connection, message = msgpack.unpackb(packed)[:3]
        attachment = self._attachments.get(performer)
        if attachment is None:
            self._tell(performer, "")
            return
        if message is None:
            if attachment.connection == connection:
                attachment.connection = None
                attachment.has_left.set()
            return
        if attachment.connection is None:
            # after a take-over, or when the bus was interrupted
            self._attach(performer, connection)
        elif attachment.connection != connection:
            self._tell(performer, attachment.connection)
            return
        attachment.last_heard_us = self._clock()
        if message and isinstance(sample := unpack(message), Sample):
            self._stage.receive_sample(performer, sample)

    def _attach(self, performer: str, connection: str) -> None:
        attachment = self._attachments[performer]
        attachment.connection, attachment.last_heard_us = connection, self._clock()
        attachment.has_left.clear()
        self._tell(performer, connection)

    def _tell(self, performer: str, connection: str) -> None:
        self._context.bus.publish(f"{self._subject}.performer.{performer}", connection.encode())

    def _require(self, performer: str) -> CastMember:
        member = self._stage.cast.find(performer)
        if member is None or performer not in self._attachments:
            raise ProblemError(404, "No such performer", f"there is no performer {performer[:40]!r}; it may have ended")
        return member

    def _end(self, performer: str) -> asyncio.Task[None]:
        """End a performance, once, in a task of this endpoint."""
        task = self._endings.get(performer)
        if task is None:
            task = asyncio.create_task(self._end_performance(performer), name=f"end performer {performer}")
            self._endings[performer] = task
            task.add_done_callback(lambda ended: self._on_ended(performer, ended))
        return task

    def _on_ended(self, performer: str, task: asyncio.Task[None]) -> None:
        self._endings.pop(performer, None)
        if not task.cancelled() and (error := task.exception()) is not None:
            _log.warning("performer %s not ended: %s; trying again", performer, error)

    async def _end_performance(self, performer: str) -> None:
        """Take a performer from the stage and request its motion.

        If the request fails, the ingest service finds the samples by itself when they have been still for a while.
        """
        cast = self._stage.cast.without(performer)
        await self._editor.change_cast(cast)
        self._is_vacant = not cast.motion
        attachment = self._attachments[performer]
        self._tell(performer, "")
        if attachment.connection is not None:
            try:
                await asyncio.wait_for(attachment.has_left.wait(), FLUSH_TIMEOUT_S)
            except TimeoutError:
                _log.warning("performer %s: its connection does not answer", performer)
        del self._attachments[performer]
        self._context.bus.publish(PERFORMANCE_SUBJECT, performer.encode())

    def _receive_motion(self, motion: bytes) -> None:
        """Show the motion of a performance on a stage that was opened for it, after the last performer has left."""
        if not self._is_vacant or self._stage.cast.members:
            return
        self._is_vacant = False
        task = asyncio.create_task(self._show_motion(motion.decode("ascii", "replace")), name="show the performance")
        self._showings.add(task)
        task.add_done_callback(self._showings.discard)

    async def _show_motion(self, motion: str) -> None:
        try:
            await self._editor.change_motion(motion)
        except (ProblemError, BackendUnavailable) as error:
            _log.warning("session %s: its performance is not shown: %s", self._stage.id, error)
