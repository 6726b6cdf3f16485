from __future__ import annotations

from fastapi import FastAPI
from fastapi.testclient import TestClient

from bunraku.http import problem_details
from bunraku.runtime.availability import BackendUnavailable
from bunraku.runtime.problem import ProblemError


def client() -> TestClient:
    app = FastAPI()
    problem_details.install_problem_handlers(app)

    @app.get("/problem")
    async def problem() -> None:
        raise ProblemError(422, "Not a dance", "line 7 is not a number", line=7, field=None, hint="check line 7")

    @app.get("/number/{number}")
    async def number(number: int) -> int:
        return number

    @app.get("/unavailable")
    async def unavailable() -> None:
        raise BackendUnavailable("the catalogue", "connection refused by 10.0.0.7")

    return TestClient(app)


def test_problem_document_has_extra_members() -> None:
    answer = client().get("/problem")
    assert answer.status_code == 422
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.json() == {
        "type": "about:blank",
        "title": "Not a dance",
        "status": 422,
        "detail": "line 7 is not a number",
        "line": 7,
        "hint": "check line 7",
    }


def test_framework_errors_become_problem_documents() -> None:
    invalid = client().get("/number/seven")
    assert invalid.status_code == 422
    assert invalid.headers["content-type"] == "application/problem+json"
    assert invalid.json()["field"] == "number"
    missing = client().get("/nowhere")
    assert missing.json()["status"] == missing.status_code == 404
    assert missing.headers["content-type"] == "application/problem+json"
    wrong = client().post("/problem")
    assert wrong.status_code == 405
    assert wrong.headers["allow"] == "GET"
    assert "POST /problem" in wrong.json()["detail"]


def test_field_path_is_written_like_an_expression() -> None:
    problem = problem_details.invalid_field_problem(("targets", 3, 1), "not a number")
    assert problem.extra["field"] == "targets[3][1]"
    assert problem.detail == "targets[3][1]: not a number"
    assert problem_details.invalid_field_problem((), "not an object").extra["field"] is None


def test_unavailable_backend_is_503_without_internal_addresses() -> None:
    answer = client().get("/unavailable")
    assert answer.status_code == answer.json()["status"] == 503
    assert answer.headers["content-type"] == "application/problem+json"
    assert int(answer.headers["retry-after"]) > 0
    assert "the catalogue" in answer.json()["detail"]
    assert "10.0.0.7" not in answer.text
