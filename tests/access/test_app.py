from __future__ import annotations

from collections.abc import Iterator
from datetime import datetime

import httpx2
import pytest

from bunraku.access.app import DEFAULT_SHARE_LIFETIME_S, MAX_SHARE_LIFETIME_S
from bunraku.http import ticket_store
from bunraku.http.access_control import Role
from tests.credentials import SECRET, bearer_headers, make_token
from tests.servers import make_bvh_clip, run_server


@pytest.fixture(scope="module")
def http(tmp_path_factory: pytest.TempPathFactory) -> Iterator[httpx2.Client]:
    with (
        run_server(tmp_path_factory.mktemp("access"), secret=SECRET) as url,
        httpx2.Client(base_url=url, headers=bearer_headers(make_token(subject="host")), timeout=60) as client,
    ):
        yield client


@pytest.fixture(scope="module")
def motion(http: httpx2.Client) -> str:
    return str(http.post("/v1/motions?filename=a.bvh", content=make_bvh_clip(1.0, 5)).json()["id"])


def test_a_link_is_told_once_and_lasts_a_week_if_nothing_else_is_said(http: httpx2.Client, motion: str) -> None:
    answer = http.post("/v1/shares", json={"motion": motion})
    made = answer.json()
    assert (answer.status_code, answer.headers["location"]) == (201, f"/v1/shares/{made['id']}")
    assert answer.headers["cache-control"] == "no-store"
    assert made["link"] == f"/?motion={motion}#share={made['token']}"
    lasts = datetime.fromisoformat(made["expires"]) - datetime.fromisoformat(made["created"])
    assert lasts.total_seconds() == DEFAULT_SHARE_LIFETIME_S
    (listed,) = [one for one in http.get("/v1/shares").json()["items"] if one["id"] == made["id"]]
    assert listed == {key: made[key] for key in ("id", "session", "motion", "by", "created", "expires")}
    assert listed["by"] == "host"


@pytest.mark.parametrize(
    ("asked", "status"),
    [
        ({}, 422),
        ({"motion": "m", "session": "s"}, 422),
        ({"motion": "none"}, 404),
        ({"session": "none"}, 404),
        ({"session": "*"}, 422),
        ({"session": "a.b"}, 422),
        ({"motion": "m" * 65}, 422),
        ({"motion": "m", "seconds": 59}, 422),
        ({"motion": "m", "seconds": MAX_SHARE_LIFETIME_S + 1}, 422),
        ({"motion": "m", "role": "admin"}, 422),
    ],
)
def test_what_cannot_be_shared_is_refused(http: httpx2.Client, asked: dict[str, object], status: int) -> None:
    answer = http.post("/v1/shares", json=asked)
    assert (answer.status_code, answer.headers["content-type"]) == (status, "application/problem+json")


def test_newer_links_come_first_and_no_more_than_are_asked_for(http: httpx2.Client, motion: str) -> None:
    given = bearer_headers(make_token(Role.CONTROL, "aiko"))
    for _ in range(3):
        assert http.post("/v1/shares", json={"motion": motion}, headers=given).status_code == 201
    assert len(http.get("/v1/shares?limit=2", headers=given).json()["items"]) == 2
    assert len(http.get("/v1/shares", headers=given).json()["items"]) == 3


def test_a_ticket_is_short_and_kept_by_nobody(http: httpx2.Client) -> None:
    answer = http.post("/v1/tickets")
    assert answer.json() == {"ticket": answer.json()["ticket"], "seconds": 30.0}
    assert len(answer.json()["ticket"]) == 48
    assert answer.headers["cache-control"] == "no-store"


def test_more_tickets_than_are_kept_are_a_429(http: httpx2.Client, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(ticket_store, "MAX_TICKETS", 0)
    assert http.post("/v1/tickets").status_code == 429
