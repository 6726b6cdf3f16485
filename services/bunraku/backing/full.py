"""What is answered where there is no room: 507, before anything is acknowledged."""

from __future__ import annotations

import contextlib
import errno
from collections.abc import Iterator

from bunraku.backing.problems import ProblemError

_ERRORS = (errno.ENOSPC, errno.EDQUOT)


def full(what: str) -> ProblemError:
    """The answer where `what` has no room."""
    return ProblemError(
        507,
        "No room left",
        f"{what} has no room left; nothing of this was kept",
        hint="remove motions, or give it more",
    )


def is_full(error: BaseException) -> bool:
    """Whether an error of the operating system, or one that tells of it in words only, says that there is no room."""
    if isinstance(error, OSError) and error.errno is not None:
        return error.errno in _ERRORS
    return any(f"os error {number})" in str(error) for number in _ERRORS)


@contextlib.contextmanager
def room(what: str) -> Iterator[None]:
    """Raises `full` in place of what the operating system says of a full disk or quota."""
    try:
        yield
    except OSError as error:
        if is_full(error):
            raise full(what) from error
        raise
