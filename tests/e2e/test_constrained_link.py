"""A narrow line from end to end: the real server, a headless viewer, and an emulated line with real TCP between."""

from __future__ import annotations

import asyncio
import os
from pathlib import Path

import pytest

from bunraku.client import Viewer, ViewerStatistics
from bunraku.codec import motion_decoder
from bunraku.codec.container import pack_motion
from bunraku.codec.motion_encoder import encode_motion
from bunraku.storage.motion_store import MotionStore
from tests.bench.network import EmulatedLink, FarEnd, missing_requirement, open_network
from tests.reverse_proxy import run_reverse_proxy
from tests.servers import run_server
from tests.vectors.blocks import random_motion


@pytest.fixture
def dance(tmp_path: Path) -> Path:
    """The folder of a server that has a dance, where lines can be emulated."""
    if (reason := missing_requirement()) is not None:
        if os.environ.get("CI") and "/dev/net/tun" not in reason:
            pytest.fail(f"in CI lines must be emulated: {reason}")
        pytest.skip(reason)
    motion_decoder.warm_up()
    encoded = encode_motion(random_motion(20.0, 30.0, 5), error_bounds_mm=(30.0, 5.0), grade="live")
    asyncio.run(MotionStore.open(f"file://{tmp_path}/library").put("dance", pack_motion("dance", encoded)))
    return tmp_path


def test_a_dance_comes_soon_over_28_kbit_and_goes_on_where_it_was_after_a_cut(dance: Path) -> None:
    shown: list[int] = []

    async def watch(viewer: Viewer) -> ViewerStatistics:
        return await viewer.watch(16.0, lambda reference, _: shown.append(reference))

    with open_network() as net, run_server(dance, host="0.0.0.0") as url:
        port = url.rpartition(":")[2]
        with net.open_links([EmulatedLink(28_800, 75, outage_s=(4.0, 10.0))]) as (far,):
            viewer = Viewer(
                f"ws://{far.host}:{port}/v1/motions/dance/stream?tracks=motion", open_socket=far.open_socket
            )
            figures = asyncio.run(watch(viewer))
    assert figures.first_pose_ms is not None
    assert figures.first_pose_ms < 3_000
    # the net that came before carried the dance over the cut
    assert figures.gaps == 0
    # the stage's time went on as the watching did, over the cut too
    assert 13e6 < shown[-1] - shown[0] < 18e6
    assert figures.reason in ("best", "line")
    assert figures.shown_kbps > 0


def test_behind_a_proxy_a_narrow_line_is_found_out_and_not_filled(dance: Path) -> None:
    async def watch(far: FarEnd, port: int) -> ViewerStatistics:
        async with run_reverse_proxy(port, host="0.0.0.0") as through:
            viewer = Viewer(
                f"ws://{far.host}:{through}/v1/motions/dance/stream?tracks=motion", open_socket=far.open_socket
            )
            return await viewer.watch(8.0)

    with open_network() as net, run_server(dance, host="0.0.0.0") as url:
        port = int(url.rpartition(":")[2])
        with net.open_links([EmulatedLink(28_800, 75, queue_bytes=64_000)]) as (far,):
            figures = asyncio.run(watch(far, port))
    assert figures.first_pose_ms is not None
    assert figures.first_pose_ms < 5_000
    assert figures.gaps == 0
    # a quick line has four seconds sent ahead; one that may be narrow has a net, which is all of this dance
    assert figures.blocks >= 16
