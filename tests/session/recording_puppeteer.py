"""Puppeteer for tests of the stage's side: it records what the stage sends."""

from __future__ import annotations

import asyncio
import secrets


class RecordingPuppeteer:
    """Handle of a puppeteer with the messages that the stage has sent."""

    def __init__(self) -> None:
        self.id = secrets.token_hex(5)
        self.queued: list[bytes] = []
        self.has_messages = asyncio.Event()
        self.is_unknown = False
        """True if the stage no longer knows this puppeteer."""

    def send(self, message: bytes) -> None:
        """Record a message; an empty one means that the stage no longer knows this puppeteer."""
        if message:
            self.queued.append(message)
        else:
            self.is_unknown = True
        self.has_messages.set()
