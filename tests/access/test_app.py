from __future__ import annotations

from collections.abc import Iterator
from datetime import datetime

import httpx2
import pytest

from bunraku.access.app import DEFAULT_SHARE_LIFETIME_S
from bunraku.http import ticket_store
from bunraku.http.access_control import Role
from bunraku.http.access_token import MAX_SHARE_LIFETIME_S
from tests.credentials import SECRET, bearer_headers, make_token
from tests.servers import make_bvh_clip, run_server
from tests.time_limit import HANG_TIMEOUT_S


@pytest.fixture(scope="module")
def http(tmp_path_factory: pytest.TempPathFactory) -> Iterator[httpx2.Client]:
    with (
        run_server(tmp_path_factory.mktemp("access"), secret=SECRET) as url,
        httpx2.Client(
            base_url=url, headers=bearer_headers(make_token(subject="host")), timeout=HANG_TIMEOUT_S
        ) as client,
    ):
        yield client


@pytest.fixture(scope="module")
def motion(http: httpx2.Client) -> str:
    return str(http.post("/v1/motions?filename=a.bvh", content=make_bvh_clip(1.0, 5)).json()["id"])


def test_created_link_has_a_token_and_the_default_lifetime(http: httpx2.Client, motion: str) -> None:
    answer = http.post("/v1/shares", json={"motion": motion})
    created = answer.json()
    assert (answer.status_code, answer.headers["location"]) == (201, f"/v1/shares/{created['id']}")
    assert answer.headers["cache-control"] == "no-store"
    assert created["link"] == f"/?motion={motion}#share={created['token']}"
    lifetime = datetime.fromisoformat(created["expires"]) - datetime.fromisoformat(created["created"])
    assert lifetime.total_seconds() == DEFAULT_SHARE_LIFETIME_S
    (listed,) = [one for one in http.get("/v1/shares").json()["items"] if one["id"] == created["id"]]
    assert listed == {key: created[key] for key in ("id", "session", "motion", "by", "created", "expires")}
    assert listed["by"] == "host"


@pytest.mark.parametrize(
    ("request_body", "status"),
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
def test_invalid_share_request_is_rejected(http: httpx2.Client, request_body: dict[str, object], status: int) -> None:
    answer = http.post("/v1/shares", json=request_body)
    assert (answer.status_code, answer.headers["content-type"]) == (status, "application/problem+json")


def test_list_is_limited_to_the_requested_number_of_own_links(http: httpx2.Client, motion: str) -> None:
    headers = bearer_headers(make_token(Role.CONTROL, "aiko"))
    for _ in range(3):
        assert http.post("/v1/shares", json={"motion": motion}, headers=headers).status_code == 201
    assert len(http.get("/v1/shares?limit=2", headers=headers).json()["items"]) == 2
    listed = http.get("/v1/shares", headers=headers)
    assert len(listed.json()["items"]) == 3
    assert listed.headers["cache-control"] == "no-store"


def test_ticket_response_is_not_cacheable(http: httpx2.Client) -> None:
    answer = http.post("/v1/tickets")
    assert answer.json() == {"ticket": answer.json()["ticket"], "seconds": 30.0}
    assert len(answer.json()["ticket"]) == 48
    assert answer.headers["cache-control"] == "no-store"


def test_too_many_tickets_are_a_429_for_their_subject_only(
    http: httpx2.Client, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(ticket_store, "MAX_TICKETS_PER_HOLDER", 3)
    flooder, other = (bearer_headers(make_token(Role.VIEW, subject)) for subject in ("flooder", "other"))
    statuses = [http.post("/v1/tickets", headers=flooder).status_code for _ in range(5)]
    assert statuses == [201] * 3 + [429] * 2
    assert http.post("/v1/tickets", headers=other).status_code == 201


def test_link_ends_with_the_token_that_created_it(http: httpx2.Client, motion: str) -> None:
    headers = bearer_headers(make_token(Role.CONTROL, "aiko", lifetime_s=3_600))
    created = http.post("/v1/shares", json={"motion": motion, "seconds": MAX_SHARE_LIFETIME_S}, headers=headers).json()
    lifetime = datetime.fromisoformat(created["expires"]) - datetime.fromisoformat(created["created"])
    assert lifetime.total_seconds() <= 3_600
    created = http.post("/v1/shares", json={"motion": motion, "seconds": MAX_SHARE_LIFETIME_S}).json()
    lifetime = datetime.fromisoformat(created["expires"]) - datetime.fromisoformat(created["created"])
    assert lifetime.total_seconds() == MAX_SHARE_LIFETIME_S


def test_bound_token_creates_links_within_its_bound_only(http: httpx2.Client, motion: str) -> None:
    session = http.post("/v1/sessions", json={"motion": motion}).json()["id"]
    other = http.post("/v1/sessions", json={"motion": motion}).json()["id"]
    for bound, expected in (
        ({"session": session}, [201, 404, 403]),
        ({"motion": motion}, [404, 404, 201]),
    ):
        headers = bearer_headers(make_token(Role.CONTROL, "bound", **bound))
        requests = ({"session": session}, {"session": other}, {"motion": motion})
        statuses = [http.post("/v1/shares", json=body, headers=headers).status_code for body in requests]
        assert statuses == expected


@pytest.mark.parametrize("kind", ["session", "motion"])
def test_bound_token_sees_and_revokes_links_within_its_bound_only(http: httpx2.Client, motion: str, kind: str) -> None:
    session = http.post("/v1/sessions", json={"motion": motion}).json()["id"]
    other = http.post("/v1/sessions", json={"motion": motion}).json()["id"]
    subject = f"host of {kind}"
    unbound = bearer_headers(make_token(Role.CONTROL, subject))
    targets = [{"session": session}, {"session": other}, {"motion": motion}]
    links = [http.post("/v1/shares", json=target, headers=unbound).json()["id"] for target in targets]
    headers = bearer_headers(make_token(Role.CONTROL, subject, **{kind: {"session": session, "motion": motion}[kind]}))
    own = links[0] if kind == "session" else links[2]
    assert [link["id"] for link in http.get("/v1/shares", headers=headers).json()["items"]] == [own]
    for link in links:
        status = http.delete(f"/v1/shares/{link}", headers=headers).status_code
        assert status == (204 if link == own else 404)
    assert len(http.get("/v1/shares", headers=unbound).json()["items"]) == 2
