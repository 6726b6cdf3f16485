"""What is answered where there is no room: 507, before anything is acknowledged."""

from __future__ import annotations

import contextlib
import errno
from collections.abc import Iterator

from bunraku.http.problem_details import ProblemError

_DISK_FULL_ERRNOS = (errno.ENOSPC, errno.EDQUOT)


def insufficient_storage(resource: str) -> ProblemError:
    """The answer where `what` has no room."""
    return ProblemError(
        507,
        "No room left",
        f"{resource} has no room left; nothing of this was kept",
        hint="remove motions, or give it more",
    )


def is_disk_full(error: BaseException) -> bool:
    """Whether an error of the operating system, or one that tells of it in words only, says that there is no room."""
    if isinstance(error, OSError) and error.errno is not None:
        return error.errno in _DISK_FULL_ERRNOS
    return any(f"os error {number})" in str(error) for number in _DISK_FULL_ERRNOS)


@contextlib.contextmanager
def translate_disk_full(resource: str) -> Iterator[None]:
    """Raises `full` in place of what the operating system says of a full disk or quota."""
    try:
        yield
    except OSError as error:
        if is_disk_full(error):
            raise insufficient_storage(resource) from error
        raise
