"""Results of jobs, passed from the job's process to the service."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from bunraku.runtime.problem import ProblemError


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


def require_result(outcome: JobResult | JobRejection, **problem_members: str) -> JobResult:
    """Return a job's result; raise `ProblemError` (422), with further `problem_members`, for a rejection."""
    if isinstance(outcome, JobRejection):
        raise ProblemError(
            422,
            outcome.title,
            outcome.detail,
            line=outcome.line,
            field=outcome.field,
            hint=outcome.hint,
            **problem_members,
        )
    return outcome
