from __future__ import annotations

from fastapi import FastAPI
from fastapi.testclient import TestClient

from bunraku.http import problem_details
from bunraku.http.problem_details import ProblemError
from bunraku.runtime.availability import BackendUnavailable


def client() -> TestClient:
    app = FastAPI()
    problem_details.install_problem_handlers(app)

    @app.get("/told")
    async def told() -> None:
        raise ProblemError(422, "Not a dance", "line 7 is not a number", line=7, field=None, hint="look there")

    @app.get("/number/{number}")
    async def number(number: int) -> int:
        return number

    @app.get("/away")
    async def away() -> None:
        raise BackendUnavailable("the catalogue", "connection refused by 10.0.0.7")

    return TestClient(app)


def test_what_was_told_is_answered_with_what_helps() -> None:
    answer = client().get("/told")
    assert answer.status_code == 422
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.json() == {
        "type": "about:blank",
        "title": "Not a dance",
        "status": 422,
        "detail": "line 7 is not a number",
        "line": 7,
        "hint": "look there",
    }


def test_the_frameworks_own_errors_are_problems_too() -> None:
    invalid = client().get("/number/seven")
    assert invalid.status_code == 422
    assert invalid.headers["content-type"] == "application/problem+json"
    assert invalid.json()["field"] == "number"
    missing = client().get("/nowhere")
    assert missing.json()["status"] == missing.status_code == 404
    assert missing.headers["content-type"] == "application/problem+json"
    wrong = client().post("/told")
    assert wrong.status_code == 405
    assert wrong.headers["allow"] == "GET"
    assert "POST /told" in wrong.json()["detail"]


def test_a_field_deep_inside_is_named_as_one_would_write_it() -> None:
    problem = problem_details.invalid_field_problem(("targets", 3, 1), "not a number")
    assert problem.extra["field"] == "targets[3][1]"
    assert problem.detail == "targets[3][1]: not a number"
    assert problem_details.invalid_field_problem((), "not an object").extra["field"] is None


def test_what_is_away_may_be_asked_again_and_addresses_stay_inside() -> None:
    answer = client().get("/away")
    assert answer.status_code == answer.json()["status"] == 503
    assert answer.headers["content-type"] == "application/problem+json"
    assert int(answer.headers["retry-after"]) > 0
    assert "the catalogue" in answer.json()["detail"]
    assert "10.0.0.7" not in answer.text
