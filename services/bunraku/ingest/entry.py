"""A motion as the API shows it."""

from __future__ import annotations

from typing import Any

from bunraku.backing.catalogue import Entry
from bunraku.backing.instants import instant


def entry_json(entry: Entry) -> dict[str, Any]:
    """A motion as the API shows it."""
    created = instant(entry.created / 1e6, "milliseconds")
    return {"id": entry.id, "created": created, "tracks": ["motion"], **entry.description}
