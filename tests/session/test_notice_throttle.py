from __future__ import annotations

from bunraku.session.notice_throttle import NOTICE_INTERVAL_US, NoticeThrottle
from bunraku.wire.messages import Notice, unpack


def test_notices_come_once_a_second_for_each_reason_and_limb() -> None:
    notices = NoticeThrottle()
    said = [
        notices.make_notice(limb, reason, now)
        for now in (5, 6, 5 + NOTICE_INTERVAL_US)
        for limb in (0, 1)
        for reason in ("rate", "owner")
    ]
    told = [m for m in map(unpack, filter(None, said)) if isinstance(m, Notice)]
    assert [(m.limb, m.reason) for m in told] == 2 * [(0, "rate"), (0, "owner"), (1, "rate"), (1, "owner")]
    assert "right hand" in told[2].detail
