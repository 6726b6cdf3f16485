"""A motion as the API shows it."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Any

from bunraku.backing.catalogue import Entry


def entry_json(entry: Entry) -> dict[str, Any]:
    """A motion as the API shows it."""
    created = datetime.fromtimestamp(entry.created / 1e6, UTC).isoformat(timespec="milliseconds")
    return {"id": entry.id, "created": created.replace("+00:00", "Z"), **entry.description}
