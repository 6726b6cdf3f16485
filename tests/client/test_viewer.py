from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager
from functools import partial
from pathlib import Path
from urllib.parse import parse_qsl

import numpy as np
import pytest
from websockets.asyncio.client import connect
from websockets.asyncio.server import ServerConnection, serve
from websockets.typing import Subprotocol

from bunraku.client import Client, StreamEnded, Viewer
from bunraku.codec.container import add_audio_track, pack_motion
from bunraku.codec.container import unpack_motion as unpack_motion
from bunraku.codec.extension.contact import encode_contacts
from bunraku.codec.extension.encoder import encode_extension
from bunraku.codec.motion_decoder import decode_motion_block
from bunraku.codec.motion_encoder import encode_motion
from bunraku.codec.scene_encoder import encode_scene
from bunraku.delivery.resume import ResumeState
from bunraku.ingest.jobs.opus import encode_audio
from bunraku.motion.analysis import analyse
from bunraku.motion.extension import ExtendedPose, extend_pose
from bunraku.motion.face import EXPRESSION_INDEX, face_expressions
from bunraku.motion.skeleton import joint_and_tip_positions, world_transforms
from bunraku.playout import timeline
from bunraku.playout.block_store import MotionBlockStore, Pose
from bunraku.storage.motion_store import MotionStore
from bunraku.wire.messages import SUBPROTOCOL, Data, Description, Problem, TimelineState
from tests.audio import decode_opus, find_onset, make_click
from tests.motion.extended_source import extended_source
from tests.patient_viewer import PatientViewer, watch_until
from tests.servers import run_server
from tests.time_limit import HANG_TIMEOUT_S
from tests.vectors.blocks import random_motion
from tests.vectors.hands_face import make_face, make_hands
from tests.vectors.scene import sample_camera, sample_light

PROTOCOL = Subprotocol(SUBPROTOCOL)


async def test_it_shows_the_dance_that_was_uploaded(server: str, tmp_path: Path) -> None:
    from tests.servers import make_bvh_clip

    source = tmp_path / "clip.bvh"
    source.write_bytes(make_bvh_clip(3.0, 77))
    async with Client(server) as client:
        motion = await client.upload(source)
        viewer = PatientViewer(client.socket_url(f"/v1/motions/{motion['id']}/stream?rate=3"))
        shown: dict[int, Pose] = {}
        figures = await viewer.watch(1.5, shown.__setitem__)
    assert figures.first_pose_ms is not None
    assert figures.gaps == 0
    assert figures.frames == len(shown)
    assert figures.rate == 3
    assert figures.bytes > 1000
    assert figures.clock_error_ms is not None
    state = viewer.timeline_history.newest
    assert state is not None
    assert viewer.track is not None
    truth = random_motion(3.0, 30.0, 77)
    late = max(t for t in shown if (t - state.clock) % 3_000_000 < 2_900_000)
    position = (late - state.clock) % 3_000_000
    frame = round(position * 30 / 1e6)
    expected = joint_and_tip_positions(truth.figure, truth.root[frame] * 0.1 + [0, 0.85, 0], truth.rotations[frame])
    error = np.linalg.norm(joint_and_tip_positions(viewer.track.figure, *shown[late]) - expected, axis=-1)
    assert error.mean() < 0.15  # within a frame's movement


def is_settled(viewer: Viewer) -> bool:
    """Return whether a viewer knows the time to half a frame and has all blocks of the highest level."""
    clock, store = viewer.clock, viewer._blocks
    if not clock.is_synchronised or store is None:
        return False
    uncertainty_us = clock.error_bound + abs(clock.offset - clock.slewed_offset)
    return uncertainty_us < 8_000 and all(store.level(index) == 3 for index in range(store.track.block_count))


async def test_two_viewers_of_a_session_show_the_same_pose_at_the_same_time(server: str, clip_file: Path) -> None:
    async with Client(server) as client:
        session = await client.open_session((await client.upload(clip_file))["id"])
        url = client.socket_url(f"/v1/sessions/{session['id']}/stream?rate=3")
        viewers = [Viewer(url), Viewer(url)]
        await asyncio.gather(*(watch_until(viewer, partial(is_settled, viewer)) for viewer in viewers))
        # the same instant of the machine's clock, each by its own idea of the reference clock
        now = time.monotonic_ns() // 1000
        times = [viewer.clock.at(now) for viewer in viewers]
        assert abs(times[0] - times[1]) < 16_667
        poses = [viewer.pose_at(times[0]) for viewer in viewers]
    assert poses[0] is not None
    assert poses[1] is not None
    np.testing.assert_allclose(poses[0][1], poses[1][1], atol=0.02)


async def test_viewers_pull_an_open_limb_together(server: str, clip_file: Path) -> None:
    async with Client(server) as client:
        motion = await client.upload(clip_file)
        session = await client.open_session(motion["id"])
        edited = await client.edit_session(session["id"], crowd={"right_hand": "median"})
        assert edited["crowd"] == [{"limb": 1, "policy": "median", "pulls": 0}]
        viewers = [Viewer(client.socket_url(f"/v1/sessions/{session['id']}/stream")) for _ in range(3)]
        watching = [asyncio.create_task(viewer.watch(HANG_TIMEOUT_S)) for viewer in viewers]
        async with asyncio.timeout(HANG_TIMEOUT_S):
            while 1 not in viewers[0].crowd_pulls or len(viewers[0].crowd_pulls[1].places) < 3:
                for n, viewer in enumerate(viewers):
                    await viewer.pull("right_hand", -0.2 * n, 0.4, 0.5)
                await asyncio.sleep(0.05)
            # not open
            await viewers[0].pull("left_leg", 0.5)
            while viewers[1].presence is None or viewers[1].presence.limbs != [None, "crowd", None, None]:
                await viewers[0].pull("right_hand", 0.0, 0.4, 0.5)
                await asyncio.sleep(0.05)
        assert (await client.edit_session(session["id"], crowd={"right_hand": None}))["crowd"] == []
        for task in watching:
            task.cancel()
        await asyncio.gather(*watching, return_exceptions=True)


async def test_a_stream_that_is_refused_says_why(server: str) -> None:
    async with Client(server) as client:
        with pytest.raises(StreamEnded, match="No such motion"):
            await Viewer(client.socket_url("/v1/motions/none/stream")).watch(1)


async def test_it_shows_camera_and_light_beside_the_dance(tmp_path: Path) -> None:
    encoded = encode_motion(random_motion(2.0, 30.0, 5), error_bounds_mm=(30.0, 5.0), grade="live")
    filmed, lit = sample_camera(2.0, 30.0), sample_light(2.0, 30.0)
    scenes = [encode_scene(filmed, error_bounds_mm=(20.0, 1.0)), encode_scene(lit, error_bounds_mm=(20.0, 1.0))]
    await MotionStore.open(f"file://{tmp_path}/library").put("filmed", pack_motion("filmed", encoded, scenes))
    with run_server(tmp_path) as url:
        viewer = Viewer(Client(url).socket_url("/v1/motions/filmed/stream?rate=1"))
        seen: dict[int, list[np.ndarray | None]] = {}
        figures = viewer.statistics
        # the first block is sent again, better, only once the second is on show
        await watch_until(
            viewer,
            lambda: min(figures.blocks, figures.camera_blocks, figures.light_blocks) >= 2,
            lambda t, _: seen.update({t: [viewer.scene_at(t, n) for n in (0, 1)]}),
        )
    assert [track.kind for track in viewer.scenes] == ["camera", "light"]
    assert (figures.blocks, figures.camera_blocks, figures.light_blocks) == (2, 2, 2)
    state = viewer.timeline_history.newest
    assert state is not None
    shown = 0
    for reference, (seen_camera, seen_light) in seen.items():
        frame = ((reference - state.clock) % 2_000_000) * 30 / 1e6
        if frame > 59 or seen_camera is None or seen_light is None:
            continue
        for values, truth in ((seen_camera, filmed.values), (seen_light, lit.values)):
            wanted = [np.interp(frame, np.arange(60), truth[:, number]) for number in range(7)]
            np.testing.assert_allclose(values, wanted, atol=0.03, rtol=0.03)
        shown += 1
    # how many there are is the machine's affair
    assert shown > 0
    last = viewer.camera_at(max(seen))
    assert last is not None
    assert viewer.scene_at(max(seen), 2) is None
    said = figures.as_json()["camera"]
    np.testing.assert_allclose([*said["position"], *said["gaze"], said["fov"]], last, atol=0.05)


async def test_it_shows_the_joints_of_an_extension(tmp_path: Path) -> None:
    analysis = analyse(extended_source(90))
    assert analysis.extension is not None
    motion, extension = analysis.motion, analysis.extension
    encoded = encode_motion(motion, error_bounds_mm=(5.0,), grade="live")
    extended = encode_extension(extension.extension, extension.values, encoded.track, [1.5])
    packed = pack_motion("extended", encoded, extensions=[extended])
    await MotionStore.open(f"file://{tmp_path}/library").put("extended", packed)
    with run_server(tmp_path) as url:
        viewer = Viewer(Client(url).socket_url("/v1/motions/extended/stream"))
        seen: dict[int, ExtendedPose] = {}

        def note(reference: int, _pose: Pose) -> None:
            if (pose := viewer.extended_pose_at(reference)) is not None:
                seen[reference] = pose

        await watch_until(viewer, lambda: len(seen) >= 5, note)
    state = viewer.timeline_history.newest
    assert state is not None
    placed = world_transforms(motion.figure, motion.root, motion.rotations)
    truth = extend_pose(motion.figure, extension.extension, *placed, extension.values)
    for reference, pose in seen.items():
        frame = round(((reference - state.clock) % 3_000_000) * 30 / 1e6) % 90
        np.testing.assert_allclose(pose.extra_positions[0], truth.extra_positions[frame], atol=0.08)
    assert viewer.extended_pose_at(max(seen), 1) is None


async def test_it_has_the_fingers_and_the_face_of_a_performer(tmp_path: Path) -> None:
    encoded = encode_motion(random_motion(1.5, 30.0, 5), error_bounds_mm=(5.0,), grade="live")
    hands, turns = make_hands(1, (3,) * 10)
    face, weights = make_face(2, ["jawOpen", "eyeBlinkLeft", "gazeYaw"])
    extensions = [
        encode_extension(each, values, encoded.track, [1.0]) for each, values in ((hands, turns), (face, weights))
    ]
    await MotionStore.open(f"file://{tmp_path}/library").put(
        "acted", pack_motion("acted", encoded, extensions=extensions)
    )
    truth = face_expressions(face, weights)
    with run_server(tmp_path) as url:
        viewer = Viewer(Client(url).socket_url("/v1/motions/acted/stream"))
        seen: dict[int, tuple[np.ndarray, dict[str, float]]] = {}

        def note(reference: int, _pose: Pose) -> None:
            fingers, expressions = viewer.fingers_at(reference), viewer.expressions_at(reference)
            if fingers is not None and expressions:
                assert fingers[0].counts == (3,) * 10
                seen[reference] = fingers[1], expressions

        await watch_until(viewer, lambda: len(seen) >= 5, note)
    state = viewer.timeline_history.newest
    assert state is not None
    for reference, (values, expressions) in seen.items():
        at = ((reference - state.clock) % 1_500_000) * 30 / 1e6
        frame = min(int(at), 43)
        wanted = turns[frame] + (at - frame) * (turns[frame + 1] - turns[frame])
        np.testing.assert_allclose(values, wanted, atol=0.5)
        assert set(expressions) == {"jawOpen", "eyeBlinkLeft", "eyeBlinkRight", "gazeYaw"}
        mouth = truth[frame : frame + 2, EXPRESSION_INDEX["jawOpen"]]
        assert mouth.min() - 0.1 <= expressions["jawOpen"] <= mouth.max() + 0.1
    assert viewer.fingers_at(max(seen), 1) is None
    assert viewer.expressions_at(max(seen), 1) == {}


async def test_it_knows_which_feet_are_planted(tmp_path: Path) -> None:
    encoded = encode_motion(random_motion(1.5, 30.0, 5), error_bounds_mm=(5.0,), grade="live")
    planted = np.stack([np.arange(45) % 30 < 15, np.arange(45) % 20 >= 10], axis=1)
    contacts = encode_contacts(planted, encoded.track)
    await MotionStore.open(f"file://{tmp_path}/library").put(
        "walked", pack_motion("walked", encoded, extensions=[contacts])
    )
    with run_server(tmp_path) as url:
        viewer = Viewer(Client(url).socket_url("/v1/motions/walked/stream"))
        seen: dict[int, tuple[bool, bool]] = {}

        def note(reference: int, _pose: Pose) -> None:
            if (found := viewer.contacts_at(reference)) is not None:
                seen[reference] = found

        await watch_until(viewer, lambda: len(seen) >= 10, note)
    state = viewer.timeline_history.newest
    assert state is not None
    for reference, found in seen.items():
        frame = int((timeline.position_at(state, reference) + 1) * 30 / 1e6)
        assert found == tuple(planted[min(frame, 44)])
    assert viewer.contacts_at(max(seen), 1) is None


async def test_it_holds_the_sound_beside_the_dance(tmp_path: Path) -> None:
    shelf = MotionStore.open(f"file://{tmp_path}/library")
    encoded = encode_motion(random_motion(2.0, 30.0, 5), error_bounds_mm=(30.0, 5.0), grade="live")
    stored = unpack_motion("dance", pack_motion("dance", encoded))
    sound = make_click(2.0, 48_000, 1.5).astype(np.float32)
    await shelf.put("sung", add_audio_track("sung", stored, encode_audio([sound], stored.first_track, 1))[0])
    with run_server(tmp_path) as url:
        viewer = Viewer(Client(url).socket_url("/v1/motions/sung/stream?rate=1"))
        ahead: dict[int, int] = {}
        figures = viewer.statistics
        await watch_until(
            viewer,
            lambda: min(figures.blocks, figures.audio_blocks) >= 2,
            lambda t, _: ahead.update({t: viewer.audio_buffered_us(t)}),
        )
    assert (figures.blocks, figures.audio_blocks) == (2, 2)
    assert figures.audio_rate >= 0
    state = viewer.timeline_history.newest
    assert state is not None
    last = max(ahead)
    assert ahead[last] == 2_000_000 - (last - state.clock) % 1_000_000, "once around, from the block on show"
    assert viewer.audio is not None
    found = viewer.packets_from(state.clock)
    assert [packet.number for packet in found] == list(range(viewer.audio.packet_count))
    played = decode_opus(packet.data for packet in found)[viewer.audio.pre_skip :]
    assert abs(find_onset(played[:, 0]) - find_onset(sound[:, 0])) < 1e-3
    late = viewer.packets_from(state.clock + 1_500_000)
    assert late == found[-len(late) :]
    assert viewer.audio.first_sample(late[0].number) <= 72_000 < viewer.audio.first_sample(late[1].number)


def told(tracks: list[dict[str, object]]) -> Viewer:
    viewer = Viewer("ws://stage/stream")
    viewer._on_message(Description("m", tracks).pack())
    viewer._on_message(TimelineState(1, "m", 0, 0, False, True, 1_000_000).pack())
    return viewer


def test_blocks_of_tracks_that_it_does_not_know_are_skipped() -> None:
    encoded = encode_motion(random_motion(1.0, 30.0, 5), error_bounds_mm=(30.0,), grade="live")
    filmed = encode_scene(sample_camera(1.0, 30.0), error_bounds_mm=(20.0,))
    later = filmed.describe() | {"codec": "bunraku.scene/9"}
    sound: dict[str, object] = {"type": "audio", "codec": "bunraku.audio/9"}
    viewer = told([{"type": "scent"}, encoded.describe(), later, sound])
    for track in (0, 2, 3, 7):
        viewer._on_message(Data(track, 0, 0, b"\1\2\3").pack())
    assert viewer.pose_at(0) is None
    assert viewer.scenes == []
    assert viewer.camera_at(0) is None
    assert viewer.audio is None
    assert (viewer.audio_buffered_us(0), viewer.packets_from(0)) == (0, [])
    viewer._on_message(Data(1, 0, 0, encoded.ladder[0].blocks[0]).pack())
    assert viewer.pose_at(0) is not None
    assert (viewer.statistics.blocks, viewer.statistics.camera_blocks) == (1, 0)


def test_a_stream_without_a_dance_says_so() -> None:
    with pytest.raises(StreamEnded, match=r"no motion track \(types of its tracks: camera\)"):
        told([encode_scene(sample_camera(1.0, 30.0), error_bounds_mm=(20.0,)).describe()])
    with pytest.raises(StreamEnded, match=r"types of its tracks: none"):
        told([])
    with pytest.raises(StreamEnded, match=r"bunraku\.motion/9"):
        told([{"type": "motion", "codec": "bunraku.motion/9"}])


class CuttingProxy:
    """Proxy of the stream at `behind`.

    It records the queries of viewers and the messages sent to them, and can cut their connections. Viewers whose
    numbers are in `refused` are asked to retry.
    """

    def __init__(self, behind: str, *refused: int) -> None:
        self.upstream_url = behind
        self.refused_connections = refused
        self.queries: list[str] = []
        self.sent: list[list[bytes]] = []
        self.cut = asyncio.Event()

    async def __call__(self, viewer: ServerConnection) -> None:
        self.queries.append(viewer.request.path.partition("?")[2] if viewer.request else "")
        self.sent.append(sent := [])
        if len(self.queries) in self.refused_connections:
            await viewer.send(Problem("Not now", "the bus does not answer; come again").pack())
            await viewer.close(1013, "Not now")
            return
        address = f"{self.upstream_url}?{self.queries[-1]}"
        async with connect(address, subprotocols=[PROTOCOL], compression=None) as line:

            async def there() -> None:
                async for said in viewer:
                    await line.send(said)

            async def back() -> None:
                async for said in line:
                    await viewer.send(said)
                    sent.append(bytes(said))  # type: ignore[arg-type]

            ways = [asyncio.create_task(way) for way in (there(), back(), self.cut.wait())]
            await asyncio.wait(ways, return_when=asyncio.FIRST_COMPLETED)
            for way in ways:
                way.cancel()
        self.cut.clear()
        await viewer.close(1012, "the server ends")

    @asynccontextmanager
    async def open(self, query: str = "") -> AsyncIterator[Viewer]:
        """Connect a viewer through the proxy."""
        async with serve(self, "127.0.0.1", 0, subprotocols=[PROTOCOL], compression=None) as opened:
            port = next(iter(opened.sockets)).getsockname()[1]
            yield Viewer(f"ws://127.0.0.1:{port}/{query}")


async def test_who_is_told_to_come_again_does(server: str, clip_file: Path) -> None:
    async with Client(server) as client:
        motion = (await client.upload(clip_file))["id"]
        door = CuttingProxy(client.socket_url(f"/v1/motions/{motion}/stream"), 2)
    async with door.open() as viewer:
        frames = 0

        def see(_reference: int, _pose: Pose) -> None:
            nonlocal frames
            if viewer.statistics.frames == 1:
                door.cut.set()
            # those after it was let in again
            frames += bool(door.sent[2:] and door.sent[2])

        await watch_until(viewer, lambda: frames > 30, see)
    assert len(door.queries) == 3
    assert viewer.reconnects == 2
    assert viewer.statistics.gaps == 0


async def test_who_comes_back_tells_of_all_performers_and_is_not_sent_again_what_it_holds(tmp_path: Path) -> None:
    first, second = (
        encode_motion(random_motion(seconds, fps, seed), error_bounds_mm=(30.0, 5.0), grade="live")
        for seconds, fps, seed in ((8.0, 30.0, 5), (9.0, 24.0, 6))
    )
    await MotionStore.open(f"file://{tmp_path}/library").put("pair", pack_motion("pair", first, others=[second]))
    with run_server(tmp_path) as url:
        door = CuttingProxy(Client(url).socket_url("/v1/motions/pair/stream"))
        async with door.open("?rate=1") as viewer:
            shown, again = asyncio.Event(), asyncio.Event()

            def see(reference: int, _: Pose) -> None:
                if viewer.pose_at(reference, 1) is not None:
                    shown.set()
                    if any(one[0] == Data.TYPE for sent in door.sent[1:] for one in sent):
                        again.set()

            watching = asyncio.create_task(viewer.watch(2 * HANG_TIMEOUT_S, see))
            async with asyncio.timeout(HANG_TIMEOUT_S):
                await shown.wait()
                door.cut.set()
                await again.wait()
            watching.cancel()
            await asyncio.gather(watching, return_exceptions=True)
    held = ResumeState.parse(dict(parse_qsl(door.queries[1]))["have"])
    assert held.track_count == 2
    assert [max(rates) for _, rates in held.performers] == [1, 1]
    before, after = ({one[:4] for one in sent if one[0] == Data.TYPE} for sent in door.sent)
    assert before
    assert after
    assert not before & after


def test_of_a_performer_that_cannot_be_played_it_holds_nothing() -> None:
    dances = [
        encode_motion(random_motion(1.0, 30.0, seed), error_bounds_mm=(30.0,), grade="live").describe()
        for seed in (5, 6, 7)
    ]
    viewer = told([dances[0], dances[1] | {"codec": "bunraku.motion/9"}, dances[2]])
    assert "&have=m.0.-.3.0..0.-&at=" in viewer._make_url()


async def test_of_a_paused_dance_the_best_of_every_performer_is_shown_soon(tmp_path: Path) -> None:
    dances = [
        encode_motion(random_motion(8.0, 30.0, seed), error_bounds_mm=(60.0, 5.0), grade="live") for seed in (5, 6)
    ]
    await MotionStore.open(f"file://{tmp_path}/library").put("pair", pack_motion("pair", dances[0], others=dances[1:]))
    with run_server(tmp_path) as url:
        async with Client(url) as client:
            session = (await client.open_session("pair", playing=False))["id"]
            viewer = Viewer(client.socket_url(f"/v1/sessions/{session}/stream"))
            wanted = []
            for dance in dances:
                store = MotionBlockStore(dance.track)
                store.put(0, 1, decode_motion_block(dance.track, dance.ladder[1].blocks[0]))
                wanted.append(store.pose_at(0))
            best = asyncio.Event()

            def see(reference: int, _: Pose) -> None:
                shown = [viewer.pose_at(reference, number) for number in (0, 1)]
                if all(
                    pose is not None and true is not None and np.array_equal(pose[1], true[1])
                    for pose, true in zip(shown, wanted, strict=True)
                ):
                    best.set()

            watching = asyncio.create_task(viewer.watch(2 * HANG_TIMEOUT_S, see))
            async with asyncio.timeout(HANG_TIMEOUT_S):
                await best.wait()
            watching.cancel()
            await asyncio.gather(watching, return_exceptions=True)
