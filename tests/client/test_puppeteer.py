from __future__ import annotations

import asyncio
from pathlib import Path

import httpx2
import numpy as np
import pytest

from bunraku.client import Client, ControlRefused, OneEuro, Puppeteer, Viewer
from bunraku.motion import rotation
from bunraku.motion.rotation import Array
from bunraku.motion.skeleton import JOINT_INDEX, world_transforms
from bunraku.playout.block_store import Pose
from bunraku.wire.messages import Input, unpack
from tests.patient_viewer import watch_until
from tests.time_limit import HANG_TIMEOUT_S

TARGET = (0.3, 0.5, 0.4)


def seen_hand(viewer: Viewer, pose: Pose) -> Array:
    """Return the position (3,) of the left hand's tip in the shoulder's frame, arm lengths."""
    assert viewer.track is not None
    figure = viewer.track.figure
    position, orientation = world_transforms(figure, *pose)
    shoulder, wrist, chest = JOINT_INDEX["l_shoulder"], JOINT_INDEX["l_wrist"], JOINT_INDEX["vl5"]
    tip = position[wrist] + rotation.rotate(orientation[wrist], figure.tips[wrist])
    length = sum(np.linalg.norm(figure.offsets[JOINT_INDEX[j]]) for j in ("l_elbow", "l_wrist")) + np.linalg.norm(
        figure.tips[wrist]
    )
    return rotation.rotate(rotation.conjugate(orientation[chest]), tip - position[shoulder]) / length


@pytest.mark.parametrize("silent", [False, True], ids=["heard all along", "silent for a while"])
async def test_a_pulled_hand_is_seen_where_it_was_pulled_by_others(server: str, clip_file: Path, silent: bool) -> None:
    async with Client(server) as client:
        session = (await client.open_session((await client.upload(clip_file))["id"]))["id"]
        viewer = Viewer(client.socket_url(f"/v1/sessions/{session}/stream?rate=3"))
        shown: list[Pose] = []

        def is_hand_in_place() -> bool:
            return viewer.statistics.overlays > 10 and bool(
                np.allclose(seen_hand(viewer, shown[-1]), TARGET, atol=0.01)
            )

        async with Puppeteer(client, session, "Aiko") as puppeteer:
            await puppeteer.claim("left_hand")
            await puppeteer.target("left_hand", *TARGET)
            with httpx2.Client(base_url=server) as http:
                # this process has something else to do until the hand is lost: it is taken again
                while silent and http.get(f"/v1/sessions/{session}").json()["limbs"][0] == puppeteer.id:
                    pass
            await watch_until(viewer, is_hand_in_place, lambda _, pose: shown.append(pose))
            await puppeteer.release("left_hand")


async def test_pulling_what_one_does_not_hold_is_refused(server: str, clip_file: Path) -> None:
    async with Client(server) as client:
        session = (await client.open_session((await client.upload(clip_file))["id"]))["id"]
        async with Puppeteer(client, session) as puppeteer:
            with pytest.raises(ControlRefused, match="not held"):
                await puppeteer.velocity("right_hand", 1)


async def test_what_a_noisy_source_says_is_steadied_before_it_is_sent() -> None:
    said: list[Input] = []

    class Overheard(Puppeteer):
        async def _send(self, data: bytes) -> None:
            message = unpack(data)
            assert isinstance(message, Input)
            said.append(message)

    async with Client("http://127.0.0.1:1") as client:
        puppeteer = Overheard(client, "nowhere")
        puppeteer._epochs[0] = 1
        smooth = OneEuro(min_cutoff=0.01, beta=0.0)
        for way in (0, 1, -1, 1, -1):
            await puppeteer.target("left_hand", 0.3 + 0.1 * way, 0.5, 0.4, smooth=smooth)
        await puppeteer.target("left_hand", 0.9)
    # the first as it is, those close after it hardly elsewhere; without the filter as it is
    np.testing.assert_allclose([m.values for m in said[:5]], [[0.3, 0.5, 0.4]] * 5, atol=0.02)
    np.testing.assert_allclose(said[5].values, [0.9, 0, 0], atol=1e-6)


async def test_a_held_limb_is_asked_for_and_given(server: str, clip_file: Path) -> None:
    async with Client(server) as client:
        session = (await client.open_session((await client.upload(clip_file))["id"]))["id"]
        async with Puppeteer(client, session, "Aiko") as aiko, Puppeteer(client, session, "Ben") as ben:
            await ben.ask("right_leg")
            await aiko.claim("left_hand")
            asking = asyncio.create_task(ben.ask("left_hand"))
            async with asyncio.timeout(HANG_TIMEOUT_S):
                while aiko.presence is None or not aiko.presence.asks[0]:  # noqa: ASYNC110
                    await asyncio.sleep(0.01)
            assert aiko.presence.asks[0] == [ben.id]
            await aiko.release("left_hand")
            await asking
            await ben.target("left_hand", 0.3, 0.2, 0.4)
            with pytest.raises(ControlRefused, match="not given"):
                await aiko.ask("left_hand", seconds=0.2)
            await ben.target("left_hand", 50.0, 0.2, 0.4)
            async with asyncio.timeout(HANG_TIMEOUT_S):
                while ben.notice is None:  # noqa: ASYNC110
                    await asyncio.sleep(0.01)
            assert (ben.notice.limb, ben.notice.reason) == (0, "reach")


async def test_both_hands_are_bonded_moved_together_and_let_go(server: str, clip_file: Path) -> None:
    async with Client(server) as client:
        session = (await client.open_session((await client.upload(clip_file))["id"]))["id"]
        viewer = Viewer(client.socket_url(f"/v1/sessions/{session}/stream?rate=3"))
        shown: list[Pose] = []

        def do_hands_touch() -> bool:
            if viewer.statistics.overlays <= 10:
                return False
            assert viewer.track is not None
            position, orientation = world_transforms(viewer.track.figure, *shown[-1])
            tips = [
                position[wrist] + rotation.rotate(orientation[wrist], viewer.track.figure.tips[wrist])
                for wrist in (JOINT_INDEX["l_wrist"], JOINT_INDEX["r_wrist"])
            ]
            return float(np.linalg.norm(tips[0] - tips[1])) < 0.005

        async with Puppeteer(client, session, "Aiko") as puppeteer:
            with pytest.raises(ControlRefused, match="owner"):
                await puppeteer.bond("left_hand", "right_hand")
            await puppeteer.claim("left_hand")
            with pytest.raises(ControlRefused, match="leg"):
                await puppeteer.bond("left_hand", "left_leg")
            await puppeteer.bond("right_hand", "left_hand")
            assert puppeteer.bonds == ((0, 1),)
            await puppeteer.target("left_hand", -0.2, 0.0, 0.5)
            await watch_until(viewer, do_hands_touch, lambda _, pose: shown.append(pose))
            await puppeteer.unbond("left_hand", "right_hand")
            await puppeteer.unbond("left_hand", "right_hand")
            presence, end = puppeteer.presence, puppeteer.bond_end
            assert presence is not None
            assert presence.bonds is None
            assert presence.limbs[0] == puppeteer.id
            assert end is not None
            assert end.reason == "released"
            await puppeteer.bond("left_hand", "right_hand")


async def test_bond_lost_with_its_hands_is_requested_again(server: str, clip_file: Path) -> None:
    async with Client(server) as client:
        session = (await client.open_session((await client.upload(clip_file))["id"]))["id"]
        async with Puppeteer(client, session, "Aiko") as puppeteer:
            for limb in ("left_hand", "right_hand"):
                await puppeteer.claim(limb)
            await puppeteer.bond("left_hand", "right_hand")
            with httpx2.Client(base_url=server) as http:
                # this process is busy until the hands are lost
                while any(http.get(f"/v1/sessions/{session}").json()["limbs"]):
                    pass
            async with asyncio.timeout(HANG_TIMEOUT_S):
                while puppeteer.bond_end is None or puppeteer.bonds != ((0, 1),):  # noqa: ASYNC110
                    await asyncio.sleep(0.01)
            assert puppeteer.bond_end.reason == "lost"
            # a bond that was let go is not requested again
            await puppeteer.release("left_hand")
            await puppeteer.claim("left_hand")
            await puppeteer.target("left_hand", *TARGET)
            assert not puppeteer.bonds


async def test_prop_is_taken_passed_and_laid_down(server: str, clip_file: Path) -> None:
    async with Client(server) as client:
        session = (await client.open_session((await client.upload(clip_file))["id"]))["id"]
        await client.edit_session(session, props={"0": "fan", "4": "umbrella"})
        async with Puppeteer(client, session, "Aiko") as aiko, Puppeteer(client, session, "Ben") as ben:
            await aiko.claim("left_hand")
            await ben.claim("right_hand")
            await aiko.put(0, "left_hand")
            with pytest.raises(ControlRefused, match="held"):
                await ben.put(0, "right_hand")
            with pytest.raises(ControlRefused, match="full"):
                await ben.put(4, "left_hand")
            await aiko.put(0, "right_hand")
            with pytest.raises(ControlRefused, match="held"):
                await aiko.lay_down(0, 0.0, 0.0)
            await ben.lay_down(0, 1.0, -0.5, 7.0)
        (fan, umbrella) = (await client.session(session))["props"]
    assert (fan["prop"], fan["kind"], fan["limb"]) == (0, "fan", None)
    assert fan["place"] == pytest.approx([1.0, -0.5, 7.0 - 2 * np.pi])
    assert (umbrella["prop"], umbrella["limb"]) == (4, None)
