"""Records of the catalogue and the errors of its methods."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Self

EDITABLE_FIELDS = ("name", "tags")
"""Members of a motion's description that its subject may change."""
_MOTION_ID_PATTERN = re.compile(r"[A-Za-z0-9]{1,64}")


def is_motion_id(text: str) -> bool:
    """Return whether a text of a client may be the id of a motion or prop. Databases and file systems reject others."""
    return _MOTION_ID_PATTERN.fullmatch(text) is not None


class InvalidCursor(ValueError):
    """A page cursor that this catalogue did not issue."""


class QuotaExceeded(Exception):
    """A motion or link that does not fit into a quota; the message names the limit."""


@dataclass(frozen=True, slots=True)
class CatalogueEntry:
    """A motion in the catalogue."""

    id: str
    created: int
    """Microseconds since 1970."""
    description: dict[str, Any]
    """Description of the motion in the API's JSON."""
    subject: str = ""
    """Subject of the token with which it was stored."""
    bytes: int = 0
    """Size of the stored object."""

    def with_edits_of(self, replaced: CatalogueEntry) -> Self:
        """Return this entry with the name and tags of the entry of the same subject that it replaces."""
        if self.subject != replaced.subject:
            return self
        kept = {key: replaced.description[key] for key in EDITABLE_FIELDS if key in replaced.description}
        return replace(self, description={**self.description, **kept})


class MotionFilter(NamedTuple):
    """Condition on listed motions. Every word of `search` occurs in the name; one of the tags is `tag`.

    Both ignore case; an empty text is no condition.
    """

    search: str = ""
    tag: str = ""


@dataclass(frozen=True, slots=True)
class Quota:
    """Limits on stored motions, per subject and in total; 0 is unlimited."""

    max_motions: int = 0
    max_bytes: int = 0
    max_total_motions: int = 0
    max_total_bytes: int = 0


@dataclass(frozen=True, slots=True)
class StoredProp:
    """A prop of the library, without its model."""

    id: str
    created: int
    """Microseconds since 1970."""
    description: dict[str, Any]
    """Description of the prop in the API's JSON."""
    subject: str = ""
    """Subject of the token with which it was stored."""


@dataclass(frozen=True, slots=True)
class PropQuota:
    """Limits on stored props, per subject and in total; 0 is unlimited."""

    max_props: int = 0
    max_total_props: int = 0


@dataclass(frozen=True, slots=True)
class Share:
    """A viewer link to a session or a motion, created by `subject`; times in seconds since 1970."""

    id: str
    created: int
    expires: int
    subject: str
    session: str | None = None
    motion: str | None = None


@dataclass(frozen=True, slots=True)
class ShareScope:
    """Viewer links that a client may list and revoke: those with these values, of which None is any."""

    subject: str | None = None
    session: str | None = None
    motion: str | None = None

    def includes(self, share: Share) -> bool:
        """Return whether a link is one of them."""
        return all(getattr(self, name) in (None, getattr(share, name)) for name in ("subject", "session", "motion"))


class JobHold(NamedTuple):
    """Hold of a replica on a job. `until` changes while the replica works; 0: the job is released."""

    holder: str
    until: int


@dataclass(frozen=True, slots=True)
class Job:
    """An uploaded file that is not yet a motion."""

    id: str
    created: int
    """Microseconds since 1970."""
    details: dict[str, Any]
    """Parameters of the job as JSON."""
    tries: int = 0
    """Number of times that a replica resumed the job after another had abandoned it."""
