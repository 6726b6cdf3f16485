"""Timestamps in API responses."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Literal


def format_timestamp(seconds: float, timespec: Literal["seconds", "milliseconds"] = "seconds") -> str:
    """Format a time in seconds since 1970 as RFC 3339 in UTC."""
    return datetime.fromtimestamp(seconds, UTC).isoformat(timespec=timespec).replace("+00:00", "Z")
