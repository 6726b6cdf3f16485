"""Notices about inputs that were changed or ignored, at most one a second per reason and limb.

The notices are defined in proto/messages.md, 3.7.
"""

from __future__ import annotations

from bunraku.wire.limbs import LIMBS, MAX_LIMBS
from bunraku.wire.messages import Notice

NOTICE_INTERVAL_US = 1_000_000
"""Interval between two notices of one reason about one limb."""
MAX_MESSAGES_PER_S = 320
"""Message rate of a puppeteer: four limbs at the frame rate of a screen, and other messages."""

_DETAILS = {
    "reach": "the {limb} was asked to a place out of reach and goes as near as it can",
    "owner": "the {limb} is not yours: an input for it was refused",
    "rate": f"more than {MAX_MESSAGES_PER_S} messages came in a second: an input for the {{limb}} was dropped",
}


_LIMB_LABELS = [
    LIMBS[limb % len(LIMBS)].replace("_", " ") + (f" of dancer {limb // len(LIMBS) + 1}" if limb >= len(LIMBS) else "")
    for limb in range(MAX_LIMBS)
]


class NoticeThrottle:
    """Throttle of the notices to one puppeteer."""

    def __init__(self) -> None:
        self._last_sent_us: dict[tuple[int, str], int] = {}

    def make_notice(self, limb: int, reason: str, now: int) -> bytes | None:
        """Return the notice, or None if the same was sent within the last second."""
        last = self._last_sent_us.get((limb, reason))
        if last is not None and now - last < NOTICE_INTERVAL_US:
            return None
        self._last_sent_us[limb, reason] = now
        return Notice(limb, reason, _DETAILS[reason].format(limb=_LIMB_LABELS[limb])).pack()
