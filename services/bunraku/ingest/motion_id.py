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
