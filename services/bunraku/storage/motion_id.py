"""Ids of motions."""

from __future__ import annotations

import base64
import hashlib


def derive_motion_id(digest: bytes) -> str:
    """Return the id for a SHA-256 digest: 20 characters of a-z and 2-7; equal content gets an equal id."""
    return base64.b32encode(digest).decode().lower()[:20]


def derive_digest(source_id: str, addition: bytes) -> bytes:
    """Return the digest for the id of a motion that is derived from another: equal additions give the same motion."""
    return hashlib.sha256(source_id.encode() + addition).digest()


def derive_job_id(motion_id: str, subject: str, file_digest: bytes = b"") -> str:
    """Return the id of a subject's job for a motion, and for a file to add: jobs of others for it have other ids."""
    return derive_motion_id(derive_digest(motion_id, file_digest + subject.encode()))
