"""Why inputs were not taken as they came, said quietly: once a second for each reason and limb (SPEC.md, Notice)."""

from __future__ import annotations

from bunraku.wire.limbs import LIMBS, MAX_LIMBS
from bunraku.wire.messages import Notice

NOTICE_INTERVAL_US = 1_000_000
"""Microseconds between two notices of one kind about one limb."""
MAX_MESSAGES_PER_S = 320
"""Messages a second that a puppeteer may send: four limbs at the rate of a screen, and what goes with them."""

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
    """Those to one puppeteer."""

    def __init__(self) -> None:
        self._last_sent_us: dict[tuple[int, str], int] = {}

    def make_notice(self, limb: int, reason: str, now: int) -> bytes | None:
        """The message, None where the same was said within the last second; `now` in microseconds."""
        last = self._last_sent_us.get((limb, reason))
        if last is not None and now - last < NOTICE_INTERVAL_US:
            return None
        self._last_sent_us[limb, reason] = now
        return Notice(limb, reason, _DETAILS[reason].format(limb=_LIMB_LABELS[limb])).pack()
