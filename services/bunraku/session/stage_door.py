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

from bunraku.backing.backing import Backing, clock
from bunraku.backing.bus import Subscription
from bunraku.backing.library import StoredMotion
from bunraku.backing.order import MOST_SECONDS
from bunraku.backing.problems import ProblemError
from bunraku.playout.timeline import position_at
from bunraku.session.puppeteers import Full
from bunraku.session.requests import SessionEdit
from bunraku.session.stage import Stage
from bunraku.wire.messages import unpack

PRESENT = 2.0
"""Seconds between two words of a replica that a puppeteer is still there."""
VANISHED = 7_000_000
"""Microseconds after which one of whom nothing is heard has gone: their replica did not live to say so."""


_log = logging.getLogger(__name__)


class Owner(Protocol):
    """Who keeps the stages of a replica."""

    async def motion(self, motion: str) -> StoredMotion:
        """A motion to be played; raises `ProblemError`."""

    async def note(self, stage: Stage) -> None:
        """Note where a stage is, so that another replica could go on with it."""

    async def end(self, session: str) -> None:
        """End a session."""


class StageDoor:
    """One stage's."""

    def __init__(self, stage: Stage, backing: Backing, owner: Owner, revision: int) -> None:
        self.stage = stage
        self.revision = revision
        """Of what stands in the register of the session, as its owner knows it."""
        self._backing = backing
        self._owner = owner
        self._subject = f"session.{stage.id}"
        bus = backing.bus
        self._subscriptions: list[Subscription] = [
            bus.subscribe(f"{self._subject}.said", self._hear),
            *(
                bus.answer(f"{self._subject}.{word}", self._answering(word, answer))
                for word, answer in (
                    ("describe", self._describe),
                    ("edit", self._edit),
                    ("log", self._log),
                    ("end", self._end),
                    ("join", self._join),
                )
            ),
        ]
        self._sweeping = asyncio.create_task(self._sweep(), name=f"puppeteers of {stage.id}")

    async def close(self) -> None:
        """Nobody comes in any more, and the stage is closed."""
        for subscription in self._subscriptions:
            subscription.end()
        self._sweeping.cancel()
        await asyncio.wait((self._sweeping,))
        for puppeteer in self.stage.puppeteers:
            puppeteer.tell(b"")
        await self.stage.close()

    def _answering(self, word: str, answer: Callable[[Any], Awaitable[Any]]) -> Callable[[bytes], Awaitable[bytes]]:
        async def answered(question: bytes) -> bytes:
            # who may see a session is asked for each of its guests' requests
            _log.log(logging.DEBUG if word == "describe" else logging.INFO, "session %s: %s", self.stage.id, word)
            try:
                said = {"answer": await answer(msgpack.unpackb(question))}
            except ProblemError as error:
                said = {"problem": error.values()}
            packed: bytes = msgpack.packb(said)
            return packed

        return answered

    async def _describe(self, _: None) -> dict[str, Any]:
        return session_json(self.stage)

    async def _edit(self, values: dict[str, Any]) -> dict[str, Any]:
        edit, stage = SessionEdit.model_validate(values), self.stage
        if edit.motion is not None and edit.motion != stage.timeline.motion:
            await stage.change(await self._owner.motion(edit.motion))
        if (edit.playing, edit.position, edit.loop) != (None, None, None):
            stage.edit(playing=edit.playing, position=edit.position, loop=edit.loop)
        await self._owner.note(stage)
        return session_json(stage)

    async def _log(self, seconds: float | None) -> dict[str, Any]:
        stage, end = self.stage, clock()
        kept = seconds or min(stage.timeline.duration * 1e-6, MOST_SECONDS)
        name = f"{stage.id[:12]}-{secrets.token_hex(12)}"
        await self._backing.library.put_log(name, stage.log.pack())
        return {"log": name, "begin": max(end - round(kept * 1e6), stage.created), "end": end}

    async def _end(self, _: None) -> None:
        await self._owner.end(self.stage.id)

    async def _join(self, values: list[str]) -> dict[str, Any]:
        who, name = values
        try:
            puppeteer = self.stage.join(
                who, name, lambda message: self._backing.bus.publish(f"{self._subject}.told.{who}", message)
            )
        except Full as error:
            raise ProblemError(503, "Full", str(error)) from None
        return {"colour": puppeteer.colour}

    def _hear(self, message: bytes) -> None:
        who, said = msgpack.unpackb(message)
        puppeteer = self.stage.puppeteers.get(who)
        if puppeteer is None:
            if said is not None:
                self._backing.bus.publish(f"{self._subject}.told.{who}", b"")
            return
        puppeteer.heard = clock()
        if said is None:
            self.stage.leave(puppeteer)
        elif said:
            self.stage.hear(puppeteer, unpack(said))

    async def _sweep(self) -> None:
        """Those who have vanished leave."""
        while True:
            begun = clock()
            await asyncio.sleep(PRESENT)
            now = clock()
            # while this process stood still nobody could be heard: that is not their silence
            deaf = max(now - begun - round(PRESENT * 1e6), 0)
            for puppeteer in self.stage.puppeteers:
                puppeteer.heard += deaf
                if now - puppeteer.heard > VANISHED:
                    puppeteer.tell(b"")
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
