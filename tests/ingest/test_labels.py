from __future__ import annotations

import asyncio
import json
from pathlib import Path
from typing import Any

import httpx2
import pytest
from pydantic import ValidationError

from bunraku.http.access_control import Access, Role
from bunraku.ingest.labels import Labels, combined_tags, require_ownership
from bunraku.runtime.problem import ProblemError
from bunraku.storage.record import CatalogueEntry
from tests.servers import make_bvh_clip, run_server
from tests.time_limit import HANG_TIMEOUT_S


def open_client(url: str) -> httpx2.AsyncClient:
    return httpx2.AsyncClient(base_url=url, timeout=HANG_TIMEOUT_S)


async def post_motion(http: httpx2.AsyncClient, seed: int, name: str = "dance") -> dict[str, Any]:
    response = await http.post("/v1/motions", params={"filename": f"{name}.bvh"}, content=make_bvh_clip(0.4, seed))
    assert response.status_code in (200, 201), response.text
    created: dict[str, Any] = response.json()
    return created


async def test_name_and_tags_change_at_every_replica_and_stay(tmp_path: Path) -> None:
    with run_server(tmp_path) as url, run_server(tmp_path) as other_url:
        async with open_client(url) as http, open_client(other_url) as other:
            motion = await post_motion(http, 61, "old name")
            assert motion["tags"] == []
            path = f"/v1/motions/{motion['id']}"
            block = await http.get(f"{path}/blocks/0/0")
            changed = await http.patch(path, json={"name": "  Kranich\u202e\n踊り ", "tags": ["Fan ", "U\u0308bung"]})
            assert changed.status_code == 200
            expected = {**motion, "name": "Kranich 踊り", "tags": ["Fan", "Übung"]}
            assert changed.json() == expected
            for replica in (http, other):
                assert (await replica.get(path)).json() == expected
                assert (await replica.get("/v1/motions")).json()["items"] == [expected]
                for query in ("search=KRANICH", "search=踊り kran", "tag=übung", "search=k&tag=FAN"):
                    assert (await replica.get(f"/v1/motions?{query}")).json()["items"] == [expected], query
                for query in ("search=old", "search=%25", "tag=fa"):
                    assert (await replica.get(f"/v1/motions?{query}")).json()["items"] == [], query
            # one at a time
            await other.patch(path, json={"tags": []})
            assert (await http.patch(path, json={"name": "Crane"})).json() == {**motion, "name": "Crane"}
            # the motion itself is unchanged
            after = await http.get(f"{path}/blocks/0/0")
            assert (after.content, after.headers["cache-control"]) == (block.content, block.headers["cache-control"])
            # the same file again is the same motion
            assert (await post_motion(http, 61, "old name"))["name"] == "Crane"
            assert (await http.patch("/v1/motions/none", json={"name": "x"})).status_code == 404
    # a restart, with the check of its objects
    with run_server(tmp_path) as url:
        async with open_client(url) as http:
            assert (await http.get(path)).json()["name"] == "Crane"


async def test_repeated_upload_of_a_lost_object_keeps_name_and_tags(tmp_path: Path) -> None:
    with run_server(tmp_path) as url:
        async with open_client(url) as http:
            motion = await post_motion(http, 62)
            await http.patch(f"/v1/motions/{motion['id']}", json={"name": "Mine", "tags": ["kept"]})
    (stored,) = await asyncio.to_thread(lambda: list(tmp_path.rglob(f"{motion['id']}.bunraku")))
    await asyncio.to_thread(stored.unlink)
    # hidden at the start, and missing afterwards
    for _ in range(2):
        with run_server(tmp_path) as url:
            async with open_client(url) as http:
                again = await post_motion(http, 62, "other name")
                assert (again["name"], again["tags"]) == ("Mine", ["kept"])
                await asyncio.to_thread(stored.unlink)
                again = await post_motion(http, 62, "other name")
                assert (again["name"], again["tags"]) == ("Mine", ["kept"])


@pytest.mark.parametrize(
    ("body", "field"),
    [
        ({}, "name"),
        ({"name": None}, "name"),
        ({"name": ""}, "name"),
        ({"name": " \u200b"}, "name"),
        ({"name": "n" * 201}, "name"),
        ({"name": 5}, "name"),
        ({"tags": None}, "tags"),
        ({"tags": "fan"}, "tags"),
        ({"tags": ["a", None]}, "tags[1]"),
        ({"tags": ["a", ""]}, "tags[1]"),
        ({"tags": ["\x1b[31m"]}, "tags[0]"),
        ({"tags": ["t" * 41]}, "tags[0]"),
        ({"tags": ["a", "b", "A"]}, "tags"),
        ({"tags": [str(number) for number in range(17)]}, "tags"),
        ({"name": "x", "duration": 3}, "duration"),
        ({"id": "x"}, "id"),
    ],
)
async def test_invalid_labels_name_their_field(server: str, body: dict[str, Any], field: str) -> None:
    async with open_client(server) as http:
        motion = await post_motion(http, 63)
        response = await http.patch(f"/v1/motions/{motion['id']}", json=body)
        assert response.status_code == 422, response.text
        assert response.headers["content-type"] == "application/problem+json"
        assert response.json()["field"] == field
        assert (await http.get(f"/v1/motions/{motion['id']}")).json() == motion


async def test_largest_labels_are_accepted_in_any_encoding(server: str) -> None:
    tags = ["\U0001f3ad" * 39 + chr(0x1F3B0 + number) for number in range(16)]
    async with open_client(server) as http:
        motion = await post_motion(http, 64)
        labels = {"name": "\U0001f3ad" * 200, "tags": tags}
        # with escapes, as some clients send it
        response = await http.patch(
            f"/v1/motions/{motion['id']}", content=json.dumps(labels), headers={"Content-Type": "application/json"}
        )
        assert response.status_code == 200, response.text
        assert response.json()["tags"] == tags
        too_large = await http.patch(f"/v1/motions/{motion['id']}", json={"name": "n" * 20_000})
        assert too_large.status_code == 413


async def test_invalid_search_names_its_parameter(server: str) -> None:
    async with open_client(server) as http:
        for name, value in (("search", "s" * 201), ("tag", "t" * 41)):
            response = await http.get("/v1/motions", params={name: value})
            assert (response.status_code, response.json()["field"]) == (422, name)
        assert (await http.get("/v1/motions", params={"search": "a " * 100, "tag": "\0"})).json()["items"] == []


async def test_derived_motions_take_the_tags(server: str) -> None:
    async with open_client(server) as http:
        one, two = await post_motion(http, 65, "one"), await post_motion(http, 66, "two")
        await http.patch(f"/v1/motions/{one['id']}", json={"name": "Eins", "tags": ["a", "b"]})
        await http.patch(f"/v1/motions/{two['id']}", json={"tags": ["B", "c"]})
        both = (await http.post(f"/v1/motions/{one['id']}/performers", json={"motions": [two["id"]]})).json()
        assert (both["name"], both["tags"]) == ("Eins + two", ["a", "b", "c"])
        light = {"time": 0, "position": [0, 3, 4], "colour": [1, 1, 1], "intensity": 1}
        staged = (await http.post(f"/v1/motions/{one['id']}/scene", json={"lights": [[light]]})).json()
        assert (staged["name"], staged["tags"]) == ("Eins", ["a", "b"])


def test_only_the_subject_and_admins_may_change_a_motion() -> None:
    entry = CatalogueEntry("m1", 5, {}, "aiko")
    require_ownership(Access(Role.INGEST, "aiko"), entry, "changing")
    require_ownership(Access(Role.ADMIN, "ben"), entry, "changing")
    with pytest.raises(ProblemError, match="m1 was stored by another subject; changing it") as raised:
        require_ownership(Access(Role.INGEST, "ben"), entry, "changing")
    assert raised.value.status == 403


def test_combined_tags_are_unique_and_bounded() -> None:
    def entry(*tags: str) -> CatalogueEntry:
        return CatalogueEntry("m", 1, {"tags": list(tags)})

    assert combined_tags([entry("A", "b"), CatalogueEntry("n", 1, {}), entry("a", "C")]) == ["A", "b", "C"]
    assert len(combined_tags([entry(*map(str, range(10))), entry(*map(str, range(20, 30)))])) == 16


def test_labels_change_only_what_they_have() -> None:
    assert Labels(name="N").apply({"name": "o", "tags": ["t"]}) == {"name": "N", "tags": ["t"]}
    assert Labels(tags=[]).apply({"name": "o", "tags": ["t"]}) == {"name": "o", "tags": []}
    with pytest.raises(ValidationError):
        Labels.model_validate({"name": None})
