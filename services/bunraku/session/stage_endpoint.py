"""The way to a stage from any replica: what is asked and said on the bus is done here, where the stage is.

On `session.{id}.` the words `describe`, `edit`, `log`, `end` and `join` are questions, answered with MessagePack of
what the API shows, or of `{"problem": ...}`. On `said` is published what puppeteers say, `[puppeteer, message]`: None
for one who has left, no bytes for one who is still there. What a puppeteer is told is published on `told.{puppeteer}`,
one whole message each; one of no bytes says that the stage does not know them.
"""

from __future__ import annotations

import asyncio
import logging
import secrets
from collections.abc import Awaitable, Callable
from typing import Any, Protocol

import msgpack

from bunraku.codec.container import StoredMotion
from bunraku.messaging.bus import Subscription
from bunraku.messaging.recording_request import MAX_RECORDING_S
from bunraku.playout.timeline import position_at
from bunraku.runtime.clock import clock
from bunraku.runtime.context import ServiceContext
from bunraku.runtime.problem import ProblemError
from bunraku.session.puppeteer_roster import SessionFull
from bunraku.session.schema import SessionEdit
from bunraku.session.stage import Stage
from bunraku.wire.messages import unpack

PUPPETEER_HEARTBEAT_S = 2.0
"""Seconds between two words of a replica that a puppeteer is still there."""
PUPPETEER_TIMEOUT_US = 7_000_000
"""Microseconds after which one of whom nothing is heard has gone: their replica did not live to say so."""


_log = logging.getLogger(__name__)


class StageOwner(Protocol):
    """Who keeps the stages of a replica."""

    async def load_motion(self, motion: str) -> StoredMotion:
        """A motion to be played; raises `ProblemError`."""

    async def save_record(self, stage: Stage) -> None:
        """Note where a stage is, so that another replica could go on with it."""

    async def end_session(self, session: str) -> None:
        """End a session."""


class StageEndpoint:
    """One stage's."""

    def __init__(self, stage: Stage, context: ServiceContext, owner: StageOwner, revision: int) -> None:
        self.stage = stage
        self.revision = revision
        """Of what stands in the register of the session, as its owner knows it."""
        self._context = context
        self._owner = owner
        self._subject = f"session.{stage.id}"
        bus = context.bus
        self._subscriptions: list[Subscription] = [
            bus.subscribe(f"{self._subject}.said", self._receive),
            *(
                bus.serve(f"{self._subject}.{word}", self._make_responder(word, answer))
                for word, answer in (
                    ("describe", self._answer_describe),
                    ("edit", self._answer_edit),
                    ("log", self._answer_log),
                    ("end", self._answer_end),
                    ("join", self._answer_join),
                )
            ),
        ]
        self._sweep_task = asyncio.create_task(self._remove_silent_puppeteers(), name=f"puppeteers of {stage.id}")

    async def close(self) -> None:
        """Nobody comes in any more, and the stage is closed."""
        for subscription in self._subscriptions:
            subscription.unsubscribe()
        self._sweep_task.cancel()
        await asyncio.wait((self._sweep_task,))
        for puppeteer in self.stage.puppeteers:
            puppeteer.send(b"")
        await self.stage.close()

    def _make_responder(
        self, operation: str, handler: Callable[[Any], Awaitable[Any]]
    ) -> Callable[[bytes], Awaitable[bytes]]:
        async def answered(question: bytes) -> bytes:
            # who may see a session is asked for each of its guests' requests
            _log.log(
                logging.DEBUG if operation == "describe" else logging.INFO, "session %s: %s", self.stage.id, operation
            )
            try:
                said = {"answer": await handler(msgpack.unpackb(question))}
            except ProblemError as error:
                said = {"problem": error.to_dict()}
            packed: bytes = msgpack.packb(said)
            return packed

        return answered

    async def _answer_describe(self, _: None) -> dict[str, Any]:
        return session_json(self.stage)

    async def _answer_edit(self, values: dict[str, Any]) -> dict[str, Any]:
        edit, stage = SessionEdit.model_validate(values), self.stage
        if edit.motion is not None and edit.motion != stage.timeline.motion:
            await stage.change_motion(await self._owner.load_motion(edit.motion))
        if (edit.playing, edit.position, edit.loop) != (None, None, None):
            stage.edit_timeline(playing=edit.playing, position=edit.position, loop=edit.loop)
        await self._owner.save_record(stage)
        return session_json(stage)

    async def _answer_log(self, seconds: float | None) -> dict[str, Any]:
        stage, end = self.stage, clock()
        kept = seconds or min(stage.timeline.duration * 1e-6, MAX_RECORDING_S)
        name = f"{stage.id[:12]}-{secrets.token_hex(12)}"
        await self._context.motion_store.put_log(name, stage.log.pack())
        return {"log": name, "begin": max(end - round(kept * 1e6), stage.created), "end": end}

    async def _answer_end(self, _: None) -> None:
        await self._owner.end_session(self.stage.id)

    async def _answer_join(self, values: list[str]) -> dict[str, Any]:
        who, name = values
        try:
            puppeteer = self.stage.join(
                who, name, lambda message: self._context.bus.publish(f"{self._subject}.told.{who}", message)
            )
        except SessionFull as error:
            raise ProblemError(503, "Full", str(error)) from None
        return {"colour": puppeteer.colour}

    def _receive(self, message: bytes) -> None:
        who, said = msgpack.unpackb(message)
        puppeteer = self.stage.puppeteers.get(who)
        if puppeteer is None:
            if said is not None:
                self._context.bus.publish(f"{self._subject}.told.{who}", b"")
            return
        puppeteer.last_heard_us = clock()
        if said is None:
            self.stage.leave(puppeteer)
        elif said:
            self.stage.receive(puppeteer, unpack(said))

    async def _remove_silent_puppeteers(self) -> None:
        """Those who have vanished leave."""
        while True:
            begun = clock()
            await asyncio.sleep(PUPPETEER_HEARTBEAT_S)
            now = clock()
            # while this process stood still nobody could be heard: that is not their silence
            deaf = max(now - begun - round(PUPPETEER_HEARTBEAT_S * 1e6), 0)
            for puppeteer in self.stage.puppeteers:
                puppeteer.last_heard_us += deaf
                if now - puppeteer.last_heard_us > PUPPETEER_TIMEOUT_US:
                    puppeteer.send(b"")
                    self.stage.leave(puppeteer)


def session_json(stage: Stage) -> dict[str, Any]:
    """A session as the API shows it."""
    state, presence = stage.timeline, stage.presence
    return {
        "id": stage.id,
        "motion": state.motion,
        "playing": state.playing,
        "loop": state.loop,
        "position": position_at(state, clock()),
        "duration": state.duration,
        "epoch": state.epoch,
        "viewers": presence.viewers,
        "puppeteers": presence.puppeteers,
        "limbs": presence.limbs,
    }
