from __future__ import annotations

from bunraku.session.notice_throttle import NOTICE_INTERVAL_US, NoticeThrottle
from bunraku.wire.messages import Notice, unpack


def test_one_notice_per_second_for_each_reason_and_limb() -> None:
    throttle = NoticeThrottle()
    packed = [
        throttle.make_notice(limb, reason, now)
        for now in (5, 6, 5 + NOTICE_INTERVAL_US)
        for limb in (0, 1)
        for reason in ("rate", "owner")
    ]
    notices = [m for m in map(unpack, filter(None, packed)) if isinstance(m, Notice)]
    assert [(m.limb, m.reason) for m in notices] == 2 * [(0, "rate"), (0, "owner"), (1, "rate"), (1, "owner")]
    assert "right hand" in notices[2].detail
