"""JSON of catalogue entries in the API."""

from __future__ import annotations

from typing import Any

from bunraku.http.timestamp import format_timestamp
from bunraku.storage.record import CatalogueEntry


def entry_json(entry: CatalogueEntry) -> dict[str, Any]:
    """Return a motion as the API describes it."""
    created = format_timestamp(entry.created / 1e6, "milliseconds")
    return {"id": entry.id, "created": created, "tracks": ["motion"], "tags": [], **entry.description}
