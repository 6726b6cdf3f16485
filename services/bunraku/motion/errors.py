"""What a reader says of motion it cannot read."""

from __future__ import annotations


class UnreadableMotion(Exception):
    """A file that cannot be read as motion, in words for the person who sent it.

    The fields are those of a problem document (RFC 9457) and the project's additions to it: `title` what is wrong in
    general, `detail` what is wrong here, `line` the line in the file counted from 1, `field` the joint or keyword,
    `hint` what to do. `line` and `field` are None where nothing can be pointed at.
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
    """`text` in quotes for a message, unprintable characters escaped, cut to `limit` characters."""
    if isinstance(text, bytes):
        text = text[: 4 * limit].decode("utf-8", "replace")
    text = text if len(text) <= limit else text[:limit] + "…"
    return "'" + "".join(c if c.isprintable() else f"\\x{ord(c):02x}" for c in text) + "'"
