from __future__ import annotations

from bunraku.ingest.entry import entry_json
from bunraku.storage.record import CatalogueEntry


def test_a_motion_is_told_with_the_time_when_it_was_made() -> None:
    shown = entry_json(CatalogueEntry("m1", 1_774_000_000_123_456, {"name": "Swan", "tracks": ["motion"]}))
    assert shown == {"id": "m1", "created": "2026-03-20T09:46:40.123Z", "name": "Swan", "tracks": ["motion"]}
