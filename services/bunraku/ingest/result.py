"""Results of jobs, passed from the job's process to the service."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

from bunraku.motion.errors import UnreadableFile
from bunraku.runtime.display_text import clean_document
from bunraku.runtime.problem import ProblemError

NOTHING_TO_KEEP = "Nothing to keep"
"""Title of the rejection of a recording or performance that has no motion."""
NOTHING_MOVES = "Nothing moves"
"""Title of the rejection of a take without movement."""
MAX_TEXT_CHARACTERS = 500
"""Maximum length of a text in a motion's description."""


@dataclass(frozen=True, slots=True)
class JobResult:
    """An encoded motion."""

    packed: bytes
    """Object for the motion store, made by `pack_motion`."""
    description: dict[str, Any]
    """Part of the motion's description in the API's JSON."""


@dataclass(frozen=True, slots=True)
class JobRejection:
    """Reason why the input of a job cannot be processed, in the members of a problem document."""

    title: str
    detail: str
    line: int | None = None
    field: str | None = None
    hint: str | None = None


def reject_file(error: UnreadableFile) -> JobRejection:
    """Return the rejection of a file that cannot be read."""
    return JobRejection(error.title, error.detail, error.line, error.field, error.hint or None)


def require_result(outcome: JobResult | JobRejection, **problem_members: str) -> JobResult:
    """Return a job's result; raise `ProblemError` (422), with further `problem_members`, for a rejection.

    The description may quote the uploaded file, for example its names of joints: its texts are cleaned.
    """
    if isinstance(outcome, JobRejection):
        raise rejection_problem(outcome, **problem_members)
    return replace(outcome, description=clean_document(outcome.description, MAX_TEXT_CHARACTERS))


def rejection_problem(rejection: JobRejection, **problem_members: str) -> ProblemError:
    """Return the problem (422) of a rejection, with further `problem_members`."""
    return ProblemError(
        422,
        rejection.title,
        rejection.detail,
        line=rejection.line,
        field=rejection.field,
        hint=rejection.hint,
        **problem_members,
    )
