from __future__ import annotations

import httpx2
import pytest

from bunraku.client.api import Client
from bunraku.ingest.performers import combined_ladder, combined_name
from bunraku.wire.messages import Description, unpack
from tests.servers import make_bvh_clip
from tests.time_limit import HANG_TIMEOUT_S


async def post_motion(http: httpx2.AsyncClient, seed: int, name: str = "dance") -> str:
    response = await http.post("/v1/motions", params={"filename": f"{name}.bvh"}, content=make_bvh_clip(2.0, seed))
    assert response.status_code in (200, 201), response.text
    return str(response.json()["id"])


async def test_performers_are_added_in_a_new_motion(server: str) -> None:
    async with httpx2.AsyncClient(base_url=server, timeout=HANG_TIMEOUT_S) as http:
        one, two = await post_motion(http, 81, "crane"), await post_motion(http, 82, "fox")
        before = (await http.get(f"/v1/motions/{one}")).json()
        response = await http.post(f"/v1/motions/{one}/performers", json={"motions": [two]})
        assert response.status_code == 201, response.text
        new = response.json()
        assert response.headers["location"] == f"/v1/motions/{new['id']}"
        assert (new["tracks"], new["performers"], new["made_from"]) == (["motion", "motion"], 2, one)
        assert (new["name"], new["pieces"]) == ("crane + fox", ["crane", "fox"])
        assert new["rates"][-1]["kbps"] > before["rates"][-1]["kbps"]
        assert (await http.get(f"/v1/motions/{one}")).json() == before
        repeated = await http.post(f"/v1/motions/{one}/performers", json={"motions": [two]})
        assert (repeated.status_code, repeated.json()) == (200, new)
        description = unpack((await http.get(f"/v1/motions/{new['id']}/description")).content)
        assert isinstance(description, Description)
        left, right = (track["place"] for track in description.tracks)
        assert left[0] < 0 < right[0]
        assert (await http.get(f"/v1/motions/{new['id']}/blocks/0/0?track=1")).content[1] >> 4 == 1
        # a third one beside the two
        three = await http.post(f"/v1/motions/{new['id']}/performers", json={"motions": [one]})
        assert (three.json()["performers"], three.json()["name"]) == (3, "crane \u00d7 2 + fox")
        placed = {"motions": [one], "places": [[0, 1, 0.5], [0, -1, 0]]}
        response = await http.post(f"/v1/motions/{one}/performers", json=placed)
        assert response.json()["name"] == "crane \u00d7 2"
        assert response.json()["id"] not in (new["id"], three.json()["id"])


async def test_invalid_request_names_its_field(server: str) -> None:
    async with httpx2.AsyncClient(base_url=server, timeout=HANG_TIMEOUT_S) as http:
        one = await post_motion(http, 83)
        two = (await http.post(f"/v1/motions/{one}/performers", json={"motions": [one]})).json()["id"]
        for body, field in (
            ({}, "motions"),
            ({"motions": []}, "motions"),
            ({"motions": [one] * 4}, "motions"),
            ({"motions": [two, one, one]}, "motions"),
            ({"motions": [one], "places": [[0, 0, 0]]}, "places"),
            ({"motions": [one], "places": [[0, 0, 0]] * 3}, "places"),
            ({"motions": [one], "places": [[0, 0, 0], [0, 101, 0]]}, "places[1]"),
            ({"motions": [one], "places": [[0, 0, 0], [0, 0]]}, "places[1]"),
            ({"motions": [one], "camera": []}, "camera"),
        ):
            response = await http.post(f"/v1/motions/{one}/performers", json=body)
            assert response.status_code == 422, response.text
            assert response.headers["content-type"] == "application/problem+json"
            assert response.json()["field"] == field
        for first, second in (("nothing", one), (one, "nothing")):
            response = await http.post(f"/v1/motions/{first}/performers", json={"motions": [second]})
            assert (response.status_code, response.json()["title"]) == (404, "No such motion")


async def test_the_sdk_adds_performers(server: str) -> None:
    async with httpx2.AsyncClient(base_url=server, timeout=HANG_TIMEOUT_S) as http, Client(server) as client:
        one = await post_motion(http, 84)
        assert (await client.add_performers(one, [one, one]))["performers"] == 3
        assert (await client.add_performers(one, [one], [[-1, 0, 0], [1, 0, 0]]))["performers"] == 2


@pytest.mark.parametrize(
    ("motion_names", "name"),
    [
        (["Crane", "Fox"], "Crane + Fox"),
        (["Fox", "Crane", "Fox"], "Fox \u00d7 2 + Crane"),
        (["a" * 150, "b" * 150], f"{'a' * 150} + {'b' * 46}\u2026"),
    ],
)
def test_name_combines_the_motion_names(motion_names: list[str], name: str) -> None:
    assert combined_name(motion_names) == name
    assert len(combined_name(motion_names)) <= 200


def test_combined_ladder_sums_bitrates_and_takes_largest_errors() -> None:
    one = [{"kbps": 1.0, "mean": 9.0, "max": 60.0}, {"kbps": 4.0, "mean": 1.0, "max": 8.0}]
    two = [{"kbps": 2.5, "mean": 7.0, "max": 30.0}]
    assert combined_ladder([one, two]) == [
        {"kbps": 3.5, "mean": 9.0, "max": 60.0},
        {"kbps": 6.5, "mean": 7.0, "max": 30.0},
    ]
