"""Reference clock of a process."""

from __future__ import annotations

import time

_MONOTONIC_OFFSET_US = time.time_ns() // 1000 - time.monotonic_ns() // 1000


def clock() -> int:
    """Return the time in microseconds since 1970, advanced by the monotonic clock so that it never steps."""
    return _MONOTONIC_OFFSET_US + time.monotonic_ns() // 1000
