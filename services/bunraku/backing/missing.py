"""The answers about what there is not. One who may not see it gets the same."""

from __future__ import annotations

from bunraku.backing.problems import ProblemError


def no_such_motion(motion: str) -> ProblemError:
    """The answer about a motion that there is not."""
    return ProblemError(404, "No such motion", f"there is no motion {motion[:40]!r}", hint="GET /v1/motions lists them")


def no_such_session(session: str) -> ProblemError:
    """The answer about a session that there is not."""
    return ProblemError(404, "No such session", f"there is no session {session[:40]!r}")
