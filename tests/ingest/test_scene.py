from __future__ import annotations

import httpx2

from bunraku.client.api import Client
from bunraku.wire.messages import Description, unpack
from tests.servers import make_bvh_clip
from tests.time_limit import HANG_TIMEOUT_S

CAMERA = [
    {"time": 0, "position": [0, 1, 4], "gaze": [0, 1, 0], "fov": 0.5},
    {"time": 1_500_000, "position": [1, 1, 4], "gaze": [0, 1, 0], "fov": 0.4, "ease": "smooth"},
]
LIGHT = [{"time": 0, "position": [-2, 4, 4], "colour": [1, 0.8, 0.5], "intensity": 118}]


async def post_motion(http: httpx2.AsyncClient, seed: int) -> str:
    response = await http.post("/v1/motions", params={"filename": "dance.bvh"}, content=make_bvh_clip(2.0, seed))
    assert response.status_code in (200, 201), response.text
    return str(response.json()["id"])


async def test_scene_is_added_in_a_new_motion(server: str) -> None:
    async with httpx2.AsyncClient(base_url=server, timeout=HANG_TIMEOUT_S) as http:
        motion = await post_motion(http, 71)
        before = (await http.get(f"/v1/motions/{motion}")).json()
        response = await http.post(f"/v1/motions/{motion}/scene", json={"camera": CAMERA, "lights": [LIGHT, LIGHT]})
        assert response.status_code == 201, response.text
        new = response.json()
        assert response.headers["location"] == f"/v1/motions/{new['id']}"
        assert (new["tracks"], new["made_from"]) == (["motion", "camera", "light", "light"], motion)
        assert (await http.get(f"/v1/motions/{motion}")).json() == before
        repeated = await http.post(f"/v1/motions/{motion}/scene", json={"camera": CAMERA, "lights": [LIGHT, LIGHT]})
        assert (repeated.status_code, repeated.json()) == (200, new)
        description = unpack((await http.get(f"/v1/motions/{new['id']}/description")).content)
        assert isinstance(description, Description)
        assert description.motion == new["id"]
        assert [track["type"] for track in description.tracks] == new["tracks"]
        block = await http.get(f"/v1/motions/{new['id']}/blocks/0/0?track=3")
        assert block.status_code == 200


async def test_invalid_request_names_its_field(server: str) -> None:
    async with httpx2.AsyncClient(base_url=server, timeout=HANG_TIMEOUT_S) as http:
        motion = await post_motion(http, 72)
        for body, field in (
            ({"camera": [CAMERA[1], CAMERA[0]]}, "camera[1].time"),
            ({"lights": [[{**LIGHT[0], "intensity": -1}]]}, "lights[0][0].intensity"),
            ({}, "camera"),
        ):
            response = await http.post(f"/v1/motions/{motion}/scene", json=body)
            assert response.status_code == 422, response.text
            assert response.headers["content-type"] == "application/problem+json"
            assert response.json()["field"] == field
        assert (await http.post("/v1/motions/nothing/scene", json={"camera": CAMERA})).status_code == 404


async def test_the_sdk_adds_a_scene(server: str) -> None:
    async with httpx2.AsyncClient(base_url=server, timeout=HANG_TIMEOUT_S) as http, Client(server) as client:
        new = await client.add_scene(await post_motion(http, 73), {"lights": [LIGHT]})
        assert new["tracks"] == ["motion", "light"]
