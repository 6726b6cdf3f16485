from __future__ import annotations

from bunraku.backing.instants import instant


def test_instants_are_in_utc_to_so_many_digits() -> None:
    assert instant(1_774_000_000.9994) == "2026-03-20T09:46:40Z"
    assert instant(1_774_000_000.1234, "milliseconds") == "2026-03-20T09:46:40.123Z"
    assert instant(0) == "1970-01-01T00:00:00Z"
