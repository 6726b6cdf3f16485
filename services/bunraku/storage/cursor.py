"""Cursors of lists, newest first: positions that stay valid whatever is added, removed or renamed."""

from __future__ import annotations

import base64
import binascii

from bunraku.storage.record import InvalidCursor, is_motion_id


def write_cursor(created: int, row_id: str) -> str:
    """Return the cursor of what follows a row."""
    return base64.urlsafe_b64encode(f"{created}:{row_id}".encode()).decode()


def parse_cursor(cursor: str) -> tuple[int, str]:
    """Return time and id of the row of a cursor; raise `InvalidCursor`."""
    try:
        created, row_id = base64.urlsafe_b64decode(cursor.encode()).decode().split(":", 1)
        if not is_motion_id(row_id):
            raise ValueError(row_id)
        return min(max(int(created), 0), (1 << 63) - 1), row_id
    except (ValueError, binascii.Error):
        raise InvalidCursor("the cursor is invalid; omit it to get the first page") from None
