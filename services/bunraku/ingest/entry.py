"""A motion as the API shows it, and the answer where there is none."""

from __future__ import annotations

from datetime import UTC, datetime
from typing import Any

from bunraku.backing.catalogue import Entry
from bunraku.backing.problems import ProblemError


def entry_json(entry: Entry) -> dict[str, Any]:
    """A motion as the API shows it."""
    created = datetime.fromtimestamp(entry.created / 1e6, UTC).isoformat(timespec="milliseconds")
    return {"id": entry.id, "created": created.replace("+00:00", "Z"), "tracks": ["motion"], **entry.description}


def no_such_motion(motion: str) -> ProblemError:
    """The answer about a motion that there is not."""
    return ProblemError(404, "No such motion", f"there is no motion {motion[:40]!r}", hint="GET /v1/motions lists them")
