"""Messages between session and ingest service about live performances.

A stage publishes the id of a performer whose performance has ended on `PERFORMANCE_SUBJECT`; the ingest service makes a
motion of the stored samples and publishes its id on `performed_subject`. Both are hints: a performance whose samples
have been still for a while becomes a motion anyway.
"""

from __future__ import annotations

import secrets

PERFORMANCE_SUBJECT = "ingest.perform"
PERFORMANCE_KEY_PREFIX = "performances"
"""Prefix of `performances.{performer}`: lease of the replica that makes the motion."""


def create_performer_id(session: str) -> str:
    """Return the id of a new performer of a session."""
    return f"{session}-{secrets.token_hex(5)}"


def session_of(performer: str) -> str:
    """Return the session of a performer; an id that was not created here may give any text."""
    return performer.rpartition("-")[0]


def performed_subject(performer: str) -> str:
    """Return the subject on which the id of a performer's motion is published."""
    return f"session.{session_of(performer)}.performed"
