"""A motion as the API shows it."""

from __future__ import annotations

from typing import Any

from bunraku.http.timestamp import format_timestamp
from bunraku.storage.catalogue import CatalogueEntry


def entry_json(entry: CatalogueEntry) -> dict[str, Any]:
    """A motion as the API shows it."""
    created = format_timestamp(entry.created / 1e6, "milliseconds")
    return {"id": entry.id, "created": created, "tracks": ["motion"], **entry.description}
