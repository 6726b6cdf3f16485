"""Props from files: from the upload to the hands of a session, its recordings and its guests, through real servers."""

from __future__ import annotations

from pathlib import Path

import httpx2
import pytest

from bunraku.client import Client, Puppeteer
from bunraku.client.server_problem import ServerProblem
from bunraku.http.access_control import Role
from bunraku.motion.readers.gltf_file import parse_gltf_file
from bunraku.wire.prop import Prop, PropState
from tests.credentials import SECRET, bearer_headers, make_token
from tests.e2e.test_props import see_props
from tests.props.samples import box_glb
from tests.servers import make_bvh_clip, run_server


@pytest.fixture
def staff(tmp_path: Path) -> Path:
    path = tmp_path / "staff.glb"
    path.write_bytes(box_glb())
    return path


async def test_prop_of_a_file_is_held_seen_and_recorded(server: str, clip_file: Path, staff: Path) -> None:
    async with Client(server) as client:
        prop = await client.add_prop(staff)
        assert prop in await client.props()
        assert len(parse_gltf_file(await client.prop_model(prop["id"])).items("meshes")) == 1
        session = (await client.open_session((await client.upload(clip_file))["id"]))["id"]
        described = await client.edit_session(session, props={"3": prop["id"]})
        assert [(each["prop"], each["kind"]) for each in described["props"]] == [(3, prop["id"])]
        held = [Prop(prop["id"], PropState(1))]
        async with Puppeteer(client, session, "Aiko") as aiko:
            await aiko.claim("right_hand")
            await aiko.put(3, "right_hand")
            await see_props(client.socket_url(f"/v1/sessions/{session}/stream"), lambda props: props == held)
        motion = (await client.record(session, name="with a staff", seconds=1.0))["id"]
        await see_props(client.socket_url(f"/v1/motions/{motion}/stream"), lambda props: props == held)
        # what is removed from the library stays where it is, and cannot be brought again
        await client.delete_prop(prop["id"])
        assert [each["kind"] for each in (await client.session(session))["props"]] == [prop["id"]]
        with pytest.raises(ServerProblem, match="there is no stored prop"):
            await client.edit_session(session, props={"4": prop["id"]})
        assert (await client.edit_session(session, props={"3": None}))["props"] == []


async def test_props_survive_a_restart(tmp_path: Path, staff: Path) -> None:
    with run_server(tmp_path) as url:
        async with Client(url) as client:
            prop = await client.add_prop(staff, length=1.2, grip="middle")
            model = await client.prop_model(prop["id"])
    with run_server(tmp_path) as url:
        async with Client(url) as client:
            assert await client.props() == [prop]
            assert await client.prop_model(prop["id"]) == model


async def test_guests_see_props_of_a_session_and_store_none(tmp_path: Path, staff: Path) -> None:
    with run_server(tmp_path, secret=SECRET) as url:
        async with Client(url, make_token()) as host:
            clip = tmp_path / "clip.bvh"
            clip.write_bytes(make_bvh_clip(1.0))
            session = (await host.open_session((await host.upload(clip))["id"]))["id"]
            prop = await host.add_prop(staff)
        async with Client(url, make_token(Role.CONTROL, session=session)) as guest:
            # whoever sees an id on the stage may have the model, but not the list
            assert (await guest.prop_model(prop["id"])).startswith(b"glTF")
            assert (await guest.edit_session(session, props={"0": prop["id"]}))["props"][0]["kind"] == prop["id"]
            for refused in (guest.props(), guest.add_prop(staff), guest.delete_prop(prop["id"])):
                with pytest.raises(ServerProblem) as raised:
                    await refused
                assert raised.value.status == 403
        async with httpx2.AsyncClient(base_url=url, headers=bearer_headers(make_token(Role.VIEW))) as viewer:
            headers = (await viewer.get(f"/v1/props/{prop['id']}/model")).headers
            assert "private" in headers["cache-control"]
            assert {"authorization", "accept-encoding"} <= {name.strip().lower() for name in headers["vary"].split(",")}
        async with httpx2.AsyncClient(base_url=url) as stranger:
            assert (await stranger.get(f"/v1/props/{prop['id']}/model")).status_code == 401


async def test_props_of_others_are_removed_by_admins_only(tmp_path: Path, staff: Path) -> None:
    with run_server(tmp_path, secret=SECRET, quota_props=1) as url:
        async with Client(url, make_token(Role.INGEST, subject="aiko")) as aiko:
            prop = await aiko.add_prop(staff)
            with pytest.raises(ServerProblem, match="you may store at most 1 props"):
                await aiko.add_prop(staff, length=2.0)
        async with Client(url, make_token(Role.INGEST, subject="ben")) as ben:
            with pytest.raises(ServerProblem, match="another subject"):
                await ben.delete_prop(prop["id"])
        async with Client(url, make_token(Role.ADMIN, subject="ken")) as ken:
            await ken.delete_prop(prop["id"])
            assert await ken.props() == []
