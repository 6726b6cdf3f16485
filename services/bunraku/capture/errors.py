"""Error of captured data."""

from __future__ import annotations

from bunraku.motion.errors import quote_excerpt

__all__ = ["UnreadableCapture", "quote_excerpt"]


class UnreadableCapture(Exception):
    """Datagram, mapping file or calibration that cannot be used, described for the person who sends it.

    `title` is the general problem, `detail` this occurrence, `field` the joint, address or key, `line` the line of a
    mapping file, from 1, `hint` the remedy. `line` and `field` are None if no place can be named.
    """

    def __init__(
        self, title: str, detail: str, *, field: str | None = None, line: int | None = None, hint: str = ""
    ) -> None:
        where = (f"line {line}: " if line is not None else "") + (f"{field}: " if field is not None else "")
        super().__init__(f"{title}: {where}{detail}" + (f" ({hint})" if hint else ""))
        self.title = title
        self.detail = detail
        self.field = field
        self.line = line
        self.hint = hint
