"""The answers about what there is not. One who may not see it gets the same."""

from __future__ import annotations

from bunraku.http.problem_details import ProblemError


def motion_not_found(motion_id: str) -> ProblemError:
    """The answer about a motion that there is not."""
    return ProblemError(
        404, "No such motion", f"there is no motion {motion_id[:40]!r}", hint="GET /v1/motions lists them"
    )


def session_not_found(session_id: str) -> ProblemError:
    """The answer about a session that there is not."""
    return ProblemError(404, "No such session", f"there is no session {session_id[:40]!r}")
