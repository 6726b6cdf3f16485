"""Time limit against hangs, the same for all tests."""

from __future__ import annotations

HANG_TIMEOUT_S = 240.0
"""Limit for a step that always ends, in seconds. It only ends a step that hangs, also on a busy machine."""
COROUTINE_TIMEOUT_S = 600.0
"""Time after which a test that is a coroutine fails; longer than `HANG_TIMEOUT_S`, which names the step."""
