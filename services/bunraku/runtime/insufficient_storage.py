"""Full disks and quotas of the file system as problem 507."""

from __future__ import annotations

import contextlib
import errno
from collections.abc import Iterator

from bunraku.runtime.problem import ProblemError

_DISK_FULL_ERRNOS = (errno.ENOSPC, errno.EDQUOT)


def insufficient_storage(resource: str) -> ProblemError:
    """Return the problem for a backend without space; nothing of the request has been stored."""
    return ProblemError(
        507,
        "No room left",
        f"{resource} has no space left; nothing of this request was stored",
        hint="remove motions, or add storage space",
    )


def is_disk_full(error: BaseException) -> bool:
    """Return whether an error reports a full disk, as an errno or in its text."""
    if isinstance(error, OSError) and error.errno is not None:
        return error.errno in _DISK_FULL_ERRNOS
    return any(f"os error {number})" in str(error) for number in _DISK_FULL_ERRNOS)


@contextlib.contextmanager
def translate_disk_full(resource: str) -> Iterator[None]:
    """Raise `insufficient_storage` instead of an OSError for a full disk or quota."""
    try:
        yield
    except OSError as error:
        if is_disk_full(error):
            raise insufficient_storage(resource) from error
        raise
