from __future__ import annotations

from pathlib import Path

import httpx2
import pytest

from bunraku.client import Client, ControlRefused, Puppeteer, ServerProblem
from bunraku.session import puppeteer_roster
from tests.credentials import SECRET, make_token
from tests.servers import make_bvh_clip, run_server


async def test_session_is_opened_edited_listed_and_ended(tmp_path: Path) -> None:
    first_source, second_source = tmp_path / "one.bvh", tmp_path / "two.bvh"
    first_source.write_bytes(make_bvh_clip(2.0, 1))
    second_source.write_bytes(make_bvh_clip(1.0, 2))
    with run_server(tmp_path / "data") as url:
        async with Client(url) as client, httpx2.AsyncClient(base_url=url) as http:
            one, two = (await client.upload(first_source))["id"], (await client.upload(second_source))["id"]
            response = await http.post("/v1/sessions", json={"motion": one, "playing": False})
            assert response.status_code == 201
            session = response.json()
            assert response.headers["location"] == f"/v1/sessions/{session['id']}"
            assert (session["motion"], session["playing"], session["loop"], session["position"]) == (
                one,
                False,
                True,
                0,
            )
            assert session["limbs"] == [None] * 4
            edited = await client.edit_session(session["id"], position=700_000, loop=False)
            assert (edited["position"], edited["loop"], edited["epoch"]) == (700_000, False, 2)
            changed = await client.edit_session(session["id"], motion=two)
            assert (changed["motion"], changed["duration"], changed["epoch"]) == (two, 1_000_000, 3)
            others = [(await client.open_session(one))["id"] for _ in range(2)]
            first_page = (await http.get("/v1/sessions?limit=2")).json()
            second_page = (await http.get(f"/v1/sessions?limit=2&cursor={first_page['next']}")).json()
            assert [s["id"] for s in first_page["items"] + second_page["items"]] == [session["id"], *others]
            assert (await http.delete(f"/v1/sessions/{others[0]}")).status_code == 204
            assert (await http.get(f"/v1/sessions/{others[0]}")).status_code == 404


@pytest.mark.parametrize(
    ("body", "status", "field"),
    [
        ({"motion": "none"}, 404, "motion"),
        ({"motion": "../../etc/passwd"}, 404, "motion"),
        ({"motion": "\0"}, 404, "motion"),
        ({}, 422, "motion"),
        ({"motion": "m", "colour": "red"}, 422, "colour"),
        ({"motion": 5}, 422, "motion"),
        ([], 422, None),
    ],
)
async def test_invalid_session_request_gives_a_problem_document(
    server: str, body: object, status: int, field: str | None
) -> None:
    async with httpx2.AsyncClient(base_url=server) as http:
        response = await http.post("/v1/sessions", json=body)
    assert response.status_code == status
    assert response.headers["content-type"] == "application/problem+json"
    assert response.json().get("field") == field


async def test_invalid_edit_changes_nothing(server: str, clip_file: Path) -> None:
    async with Client(server) as client, httpx2.AsyncClient(base_url=server) as http:
        session = await client.open_session((await client.upload(clip_file))["id"], playing=False)
        path = f"/v1/sessions/{session['id']}"
        for body in ({"position": -1}, {"position": 1 << 60}, {"motion": "none"}, {"speed": 2}):
            assert (await http.patch(path, json=body)).status_code in (404, 422)
        assert (await http.get(path)).json() == session
        assert (await http.patch("/v1/sessions/none", json={"playing": True})).status_code == 404


async def test_sessions_and_puppeteers_are_limited_by_the_subject_of_the_token(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(puppeteer_roster, "MAX_PUPPETEERS_PER_SUBJECT", 1)
    source = tmp_path / "one.bvh"
    source.write_bytes(make_bvh_clip(2.0, 1))
    aiko, ben = (make_token(subject=name) for name in ("aiko", "ben"))
    with run_server(tmp_path / "data", secret=SECRET, quota_sessions=2) as url:
        async with Client(url, token=aiko) as client, Client(url, token=ben) as other:
            motion = (await client.upload(source))["id"]
            session, _ = [(await client.open_session(motion))["id"] for _ in range(2)]
            with pytest.raises(ServerProblem, match="2 open sessions") as refused:
                await client.open_session(motion)
            assert refused.value.status == 403
            await other.open_session(motion)
            async with Puppeteer(client, session, "Aiko"):
                with pytest.raises(ControlRefused, match="1 puppeteers with this link"):
                    async with Puppeteer(client, session, "Another name"):
                        pytest.fail("joined twice")
                async with Puppeteer(other, session, "Ben"):
                    assert len((await client.session(session))["puppeteers"]) == 2
