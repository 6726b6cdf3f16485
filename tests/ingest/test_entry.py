from __future__ import annotations

from bunraku.ingest.entry import entry_json
from bunraku.storage.record import CatalogueEntry


def test_entry_json_has_the_creation_time() -> None:
    described = entry_json(CatalogueEntry("m1", 1_774_000_000_123_456, {"name": "Swan", "tracks": ["motion"]}))
    assert described == {
        "id": "m1",
        "created": "2026-03-20T09:46:40.123Z",
        "name": "Swan",
        "tracks": ["motion"],
        "tags": [],
    }
