"""Received messages of a puppeteer that wait for their turn at the stage."""

from __future__ import annotations

from collections import deque

from bunraku.runtime.input_scheduler import InputScheduler
from bunraku.session.puppeteer_roster import Puppeteer
from bunraku.session.stage import Stage
from bunraku.wire.messages import unpack

MAX_WAITING_MESSAGES = 2_048
"""Messages of one puppeteer that wait: more than its replica lets through in some seconds."""


class PuppeteerInput:
    """Input of one puppeteer, who may be connected to another replica.

    The stage handles the messages of all puppeteers in turns, whatever their number: a burst delays no frame.
    """

    def __init__(self, puppeteer: Puppeteer, stage: Stage, scheduler: InputScheduler) -> None:
        self.source = puppeteer.subject or puppeteer.id
        self._puppeteer = puppeteer
        self._stage = stage
        self._scheduler = scheduler
        self._waiting: deque[bytes | None] = deque()

    def add(self, message: bytes | None) -> None:
        """Handle a message in its turn; None means that the puppeteer has left. Too many messages end the puppeteer."""
        if len(self._waiting) >= MAX_WAITING_MESSAGES:
            self._waiting.clear()
            self._waiting.append(None)
            self._puppeteer.send(b"")
            return
        self._waiting.append(message)
        if len(self._waiting) > 1:
            return
        try:
            self._scheduler.schedule(self)
        except Exception:
            self.abort()
            raise

    def handle_input(self) -> bool:
        """Apply one message. Return whether another waits."""
        message = self._waiting[0]
        try:
            if self._stage.puppeteers.get(self._puppeteer.id) is not self._puppeteer:
                self._waiting.clear()
            elif message is None:
                self._stage.leave(self._puppeteer)
            else:
                self._stage.receive(self._puppeteer, unpack(message))
        finally:
            if self._waiting:
                self._waiting.popleft()
        return bool(self._waiting)

    def pause_reading(self) -> None:
        """Do nothing: the puppeteer's replica limits its rate."""

    def resume_reading(self) -> None:
        """Do nothing."""

    def abort(self) -> None:
        """Remove the puppeteer after a failure."""
        self._waiting.clear()
        self._puppeteer.send(b"")
        self._stage.leave(self._puppeteer)
