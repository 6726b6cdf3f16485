"""A headless viewer of a real server over an emulated constrained link with real TCP."""

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
def data_folder(tmp_path: Path) -> Path:
    """Return the data folder of a server with one motion; skip where links cannot be emulated."""
    if (reason := missing_requirement()) is not None:
        if os.environ.get("CI") and "/dev/net/tun" not in reason:
            pytest.fail(f"emulated links are required in CI: {reason}")
        pytest.skip(reason)
    motion_decoder.warm_up()
    encoded = encode_motion(random_motion(20.0, 30.0, 5), error_bounds_mm=(30.0, 5.0), grade="live")
    asyncio.run(MotionStore.open(f"file://{tmp_path}/library").put("dance", pack_motion("dance", encoded)))
    return tmp_path


def test_28_kbit_link_starts_within_3_s_and_resumes_after_an_outage(data_folder: Path) -> None:
    shown: list[int] = []

    async def watch(viewer: Viewer) -> ViewerStatistics:
        return await viewer.watch(16.0, lambda reference, _: shown.append(reference))

    with open_network() as network, run_server(data_folder, host="0.0.0.0") as url:
        port = url.rpartition(":")[2]
        with network.open_links([EmulatedLink(28_800, 75, outage_s=(4.0, 10.0))]) as (far,):
            viewer = Viewer(
                f"ws://{far.host}:{port}/v1/motions/dance/stream?tracks=motion", open_socket=far.open_socket
            )
            statistics = asyncio.run(watch(viewer))
    assert statistics.first_pose_ms is not None
    assert statistics.first_pose_ms < 3_000
    # the prefetched base layer covers the outage
    assert statistics.gaps == 0
    # the reference clock advanced with the time watched, also during the outage
    assert 13e6 < shown[-1] - shown[0] < 18e6
    assert statistics.reason in ("best", "line")
    assert statistics.shown_kbps > 0


def test_constrained_link_behind_a_proxy_is_detected_and_not_filled(data_folder: Path) -> None:
    async def watch(far: FarEnd, port: int) -> ViewerStatistics:
        async with run_reverse_proxy(port, host="0.0.0.0") as proxy_port:
            viewer = Viewer(
                f"ws://{far.host}:{proxy_port}/v1/motions/dance/stream?tracks=motion", open_socket=far.open_socket
            )
            return await viewer.watch(8.0)

    with open_network() as network, run_server(data_folder, host="0.0.0.0") as url:
        port = int(url.rpartition(":")[2])
        with network.open_links([EmulatedLink(28_800, 75, queue_bytes=64_000)]) as (far,):
            statistics = asyncio.run(watch(far, port))
    assert statistics.first_pose_ms is not None
    assert statistics.first_pose_ms < 5_000
    assert statistics.gaps == 0
    # an unconstrained link gets four seconds ahead; a possibly constrained one the base layer, here the whole motion
    assert statistics.blocks >= 16
