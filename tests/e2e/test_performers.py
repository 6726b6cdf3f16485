"""Several performers on one stage, pulled at by two people, watched, and kept, over real sockets."""

from __future__ import annotations

import asyncio
import math
from pathlib import Path

import httpx2
import numpy as np

from bunraku.client import Client, Puppeteer, Viewer
from bunraku.codec.motion_decoder import decode_motion_block
from bunraku.codec.motion_track import parse_motion_track
from bunraku.motion.placement import Placement
from bunraku.motion.skeleton import joint_and_tip_positions
from bunraku.playout.block_store import MotionBlockStore, Pose
from bunraku.playout.timeline import position_at
from bunraku.wire.messages import Data, Description, unpack
from tests.servers import make_bvh_clip, run_server

LEFT_TIP, RIGHT_TIP = 19, 20


async def load_performer(http: httpx2.AsyncClient, motion: str, performer: int) -> tuple[MotionBlockStore, Placement]:
    """What a performer dances, at the best rate, and where."""
    description = unpack((await http.get(f"/v1/motions/{motion}/description")).content)
    assert isinstance(description, Description)
    said = description.tracks[performer]
    store, rate = MotionBlockStore(parse_motion_track(said)), len(said["rates"]) - 1
    for index in range(store.track.block_count):
        answer = await http.get(f"/v1/motions/{motion}/blocks/{rate}/{index}?track={performer}")
        store.put(index, rate, decode_motion_block(store.track, Data.unpack(answer.content).block))
    return store, Placement.parse(said["place"])


def tip_positions(store: MotionBlockStore, pose: Pose) -> np.ndarray:
    """World places of both hands' tips."""
    return joint_and_tip_positions(store.track.figure, *pose)[[LEFT_TIP, RIGHT_TIP]]


async def test_three_dance_side_by_side_and_each_has_strings_of_its_own(tmp_path: Path) -> None:
    for name, seed in (("Swan", 91), ("Fox", 92)):
        (tmp_path / f"{name}.bvh").write_bytes(make_bvh_clip(3.0, seed))
    with run_server(tmp_path / "data") as url:
        async with Client(url) as client, httpx2.AsyncClient(base_url=url) as http:
            swan, fox = [await client.upload(tmp_path / f"{name}.bvh") for name in ("Swan", "Fox")]
            trio = await client.add_performers(swan["id"], [fox["id"], swan["id"]])
            session = (await client.open_session(trio["id"]))["id"]
            dances = [await load_performer(http, trio["id"], nth) for nth in range(3)]
            viewer = Viewer(client.socket_url(f"/v1/sessions/{session}/stream?rate=4"))
            seen: list[tuple[int, list[Pose | None]]] = []

            def note(reference: int, _: Pose) -> None:
                seen.append((reference, [viewer.pose_at(reference, nth) for nth in range(3)]))

            async with Puppeteer(client, session) as aiko, Puppeteer(client, session) as ben:
                watching = asyncio.create_task(viewer.watch(3.0, note, frame_interval=1 / 30))
                await aiko.claim("left_hand")
                await ben.claim(9)
                loop = asyncio.get_running_loop()
                end = loop.time() + 2.5
                while (now := loop.time()) < end:
                    await aiko.target("left_hand", 0.7, 0.5 + 0.3 * math.sin(4 * now), 0.4)
                    await ben.target(9, -0.6, 0.6, 0.5)
                    await asyncio.sleep(1 / 60)
                assert viewer.presence is not None
                assert [limb for limb, holder in enumerate(viewer.presence.limbs) if holder is not None] == [0, 9]
                assert len(viewer.presence.limbs) == 12
                kept = await client.record(session, None, 2.0)
                await watching
    assert viewer.statistics.gaps == 0
    pulled: list[list[np.ndarray]] = [[], [], []]
    roots: list[list[np.ndarray]] = [[], [], []]
    state = viewer.timeline_history.newest
    assert state is not None
    for reference, poses in seen:
        for nth, ((store, place), pose) in enumerate(zip(dances, poses, strict=True)):
            dance = store.pose_at(position_at(state, reference), True, state.duration)
            assert dance is not None
            if pose is not None:
                off = tip_positions(store, pose) - tip_positions(store, place.apply(*dance))
                pulled[nth].append(np.linalg.norm(off, axis=-1))
                roots[nth].append(pose[0])
    assert all(len(frames) > 30 for frames in pulled)
    moved = [np.max(frames, axis=0) for frames in pulled]
    # the first's left hand, and the third's right hand: all others are the dance's, of which a first
    # block may be of the lowest rate, within 60 mm
    assert moved[0][0] > 0.2
    assert moved[2][1] > 0.2
    for quiet in (moved[0][1], *moved[1], moved[2][0]):
        assert quiet < 0.06
    across = [np.mean([root[0] for root in frames]) for frames in roots]
    assert across[0] < across[1] < across[2]
    assert (kept["performers"], kept["tracks"]) == (3, ["motion"] * 3)
    assert kept["name"] == "Swan × 2 + Fox, kept"
