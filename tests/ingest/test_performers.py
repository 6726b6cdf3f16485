from __future__ import annotations

import httpx2
import pytest

from bunraku.client.api import Client
from bunraku.ingest.performers import combined_ladder, combined_name
from bunraku.wire.messages import Description, unpack
from tests.servers import make_bvh_clip


async def post_motion(http: httpx2.AsyncClient, seed: int, name: str = "dance") -> str:
    answer = await http.post("/v1/motions", params={"filename": f"{name}.bvh"}, content=make_bvh_clip(2.0, seed))
    assert answer.status_code in (200, 201), answer.text
    return str(answer.json()["id"])


async def test_others_dance_beside_in_another_motion_and_the_first_stays_as_it_is(server: str) -> None:
    async with httpx2.AsyncClient(base_url=server, timeout=60) as http:
        one, two = await post_motion(http, 81, "crane"), await post_motion(http, 82, "fox")
        before = (await http.get(f"/v1/motions/{one}")).json()
        answer = await http.post(f"/v1/motions/{one}/performers", json={"motions": [two]})
        assert answer.status_code == 201, answer.text
        new = answer.json()
        assert answer.headers["location"] == f"/v1/motions/{new['id']}"
        assert (new["tracks"], new["performers"], new["made_from"]) == (["motion", "motion"], 2, one)
        assert (new["name"], new["pieces"]) == ("crane + fox", ["crane", "fox"])
        assert new["rates"][-1]["kbps"] > before["rates"][-1]["kbps"]
        assert (await http.get(f"/v1/motions/{one}")).json() == before
        again = await http.post(f"/v1/motions/{one}/performers", json={"motions": [two]})
        assert (again.status_code, again.json()) == (200, new)
        description = unpack((await http.get(f"/v1/motions/{new['id']}/description")).content)
        assert isinstance(description, Description)
        left, right = (track["place"] for track in description.tracks)
        assert left[0] < 0 < right[0]
        assert (await http.get(f"/v1/motions/{new['id']}/blocks/0/0?track=1")).content[1] >> 4 == 1
        # and more of them, beside those who are two already
        three = await http.post(f"/v1/motions/{new['id']}/performers", json={"motions": [one]})
        assert (three.json()["performers"], three.json()["name"]) == (3, "crane \u00d7 2 + fox")
        placed = {"motions": [one], "places": [[0, 1, 0.5], [0, -1, 0]]}
        answer = await http.post(f"/v1/motions/{one}/performers", json=placed)
        assert answer.json()["name"] == "crane \u00d7 2"
        assert answer.json()["id"] not in (new["id"], three.json()["id"])


async def test_what_is_wrong_is_said_with_its_field(server: str) -> None:
    async with httpx2.AsyncClient(base_url=server, timeout=60) as http:
        one = await post_motion(http, 83)
        two = (await http.post(f"/v1/motions/{one}/performers", json={"motions": [one]})).json()["id"]
        for asked, field in (
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
            answer = await http.post(f"/v1/motions/{one}/performers", json=asked)
            assert answer.status_code == 422, answer.text
            assert answer.headers["content-type"] == "application/problem+json"
            assert answer.json()["field"] == field
        for first, second in (("nothing", one), (one, "nothing")):
            answer = await http.post(f"/v1/motions/{first}/performers", json={"motions": [second]})
            assert (answer.status_code, answer.json()["title"]) == (404, "No such motion")


async def test_the_sdk_adds_performers(server: str) -> None:
    async with httpx2.AsyncClient(base_url=server, timeout=60) as http, Client(server) as client:
        one = await post_motion(http, 84)
        assert (await client.add_performers(one, [one, one]))["performers"] == 3
        assert (await client.add_performers(one, [one], [[-1, 0, 0], [1, 0, 0]]))["performers"] == 2


@pytest.mark.parametrize(
    ("pieces", "name"),
    [
        (["Crane", "Fox"], "Crane + Fox"),
        (["Fox", "Crane", "Fox"], "Fox \u00d7 2 + Crane"),
        (["a" * 150, "b" * 150], f"{'a' * 150} + {'b' * 46}\u2026"),
    ],
)
def test_it_is_called_by_what_is_danced(pieces: list[str], name: str) -> None:
    assert combined_name(pieces) == name
    assert len(combined_name(pieces)) <= 200


def test_rates_of_several_cost_what_all_cost_and_keep_what_the_worst_keeps() -> None:
    one = [{"kbps": 1.0, "mean": 9.0, "max": 60.0}, {"kbps": 4.0, "mean": 1.0, "max": 8.0}]
    two = [{"kbps": 2.5, "mean": 7.0, "max": 30.0}]
    assert combined_ladder([one, two]) == [
        {"kbps": 3.5, "mean": 9.0, "max": 60.0},
        {"kbps": 6.5, "mean": 7.0, "max": 30.0},
    ]
