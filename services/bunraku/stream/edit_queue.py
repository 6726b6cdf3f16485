"""Edits of a viewer's own timeline, of which those in quick succession are combined."""

from __future__ import annotations

from bunraku.wire.messages import Edit

EDIT_INTERVAL_US = 50_000
"""Minimum time between two edits, in microseconds."""


class EditQueue:
    """Combination of the edits that have not taken effect yet. Times are arguments, in microseconds."""

    __slots__ = ("_next_at", "_pending")

    def __init__(self) -> None:
        self._pending: Edit | None = None
        self._next_at = 0

    @property
    def due_at(self) -> int | None:
        """Clock time at which the pending edit takes effect; None without one."""
        return None if self._pending is None else self._next_at

    def add(self, edit: Edit) -> None:
        """Add an edit, which replaces what it has in common with the pending one."""
        self._pending = edit if self._pending is None else _combine(self._pending, edit)

    def take(self, now: int) -> Edit | None:
        """Return the pending edit if it is due."""
        if now < self._next_at or self._pending is None:
            return None
        edit, self._pending, self._next_at = self._pending, None, now + EDIT_INTERVAL_US
        return edit


def _combine(earlier: Edit, later: Edit) -> Edit:
    """Return an edit with the effect of both."""
    return Edit(
        playing=earlier.playing if later.playing is None else later.playing,
        position=earlier.position if later.position is None else later.position,
        loop=earlier.loop if later.loop is None else later.loop,
    )
