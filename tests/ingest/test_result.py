from __future__ import annotations

import pytest

from bunraku.ingest.result import JobRejection, JobResult, require_result
from bunraku.runtime.problem import ProblemError


def test_result_is_returned() -> None:
    result = JobResult(b"packed", {"frames": 3})
    assert require_result(result, filename="a.bvh") == result


def test_names_from_the_file_are_cleaned() -> None:
    description = {"joints": {"hip": "Hips\x1b[2J\u202e"}, "guessed": ["Head\nis \x00the head"], "frames": 3}
    assert require_result(JobResult(b"packed", description)).description == {
        "joints": {"hip": "Hips"},
        "guessed": ["Head is the head"],
        "frames": 3,
    }


def test_rejection_becomes_a_422_with_its_members() -> None:
    rejection = JobRejection("Bad value", "line 7 has a word", line=7, hint="export it again")
    with pytest.raises(ProblemError) as raised:
        require_result(rejection, filename="a.bvh")
    assert raised.value.to_dict() == {
        "status": 422,
        "title": "Bad value",
        "detail": "line 7 has a word",
        "line": 7,
        "hint": "export it again",
        "filename": "a.bvh",
    }
