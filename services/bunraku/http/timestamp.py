"""Instants as the API writes them."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Literal


def format_timestamp(seconds: float, timespec: Literal["seconds", "milliseconds"] = "seconds") -> str:
    """The time `seconds` after the beginning of 1970, in UTC (RFC 3339), to so many digits."""
    return datetime.fromtimestamp(seconds, UTC).isoformat(timespec=timespec).replace("+00:00", "Z")
