"""Errors of the readers of motions and props."""

from __future__ import annotations


class UnreadableFile(Exception):
    """File that cannot be read, described for the person who sent it.

    The attributes are those of a problem document (RFC 9457) and this project's extensions: `title` the general
    problem, `detail` this occurrence, `line` the line number in the file, from 1, `field` the joint or keyword, `hint`
    the remedy. `line` and `field` are None if no place can be named.
    """

    def __init__(
        self, title: str, detail: str, *, line: int | None = None, field: str | None = None, hint: str = ""
    ) -> None:
        where = f"line {line}: " if line is not None else ""
        super().__init__(f"{title}: {where}{detail}" + (f" ({hint})" if hint else ""))
        self.title = title
        self.detail = detail
        self.line = line
        self.field = field
        self.hint = hint


def quote_excerpt(text: bytes | str, limit: int = 40) -> str:
    """Return `text` in quotes for a message: unprintable characters escaped, cut to `limit` characters."""
    if isinstance(text, bytes):
        text = text[: 4 * limit].decode("utf-8", "replace")
    text = text if len(text) <= limit else text[:limit] + "…"
    return "'" + "".join(c if c.isprintable() else f"\\x{ord(c):02x}" for c in text) + "'"
