from __future__ import annotations

from bunraku.http.timestamp import format_timestamp


def test_timestamp_is_utc_with_the_requested_precision() -> None:
    assert format_timestamp(1_774_000_000.9994) == "2026-03-20T09:46:40Z"
    assert format_timestamp(1_774_000_000.1234, "milliseconds") == "2026-03-20T09:46:40.123Z"
    assert format_timestamp(0) == "1970-01-01T00:00:00Z"
