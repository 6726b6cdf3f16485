"""State of a stream before it is live; tests/e2e/test_capture_stream.py streams to a server."""

from __future__ import annotations

import numpy as np

from bunraku.capture.retarget import Pose
from bunraku.capture.session import TimedPose
from bunraku.capture_stream import PerformanceStream, StreamOptions
from bunraku.motion.skeleton import JOINT_COUNT, standard_figure
from tests.processes import free_port

POSE = TimedPose(1.0, Pose(np.zeros(3), np.tile([1.0, 0.0, 0.0, 0.0], (JOINT_COUNT, 1)), {}))


def make_options() -> StreamOptions:
    return StreamOptions(f"http://127.0.0.1:{free_port()}", None, None, "Aiko", 60.0, None)


def test_poses_before_the_stage_is_reached_are_not_kept() -> None:
    stream = PerformanceStream(make_options())
    stream.offer([POSE] * 1000)
    assert stream.describe(60.0) == "joining the stage"
    statistics = stream.statistics()
    assert (statistics["sent"], statistics["dropped"], statistics["page"]) == (0, 0, None)


async def test_unreachable_server_ends_the_performance_with_the_reason() -> None:
    options = make_options()
    stream = PerformanceStream(options)
    await stream.run(standard_figure())
    assert stream.problem is not None
    assert stream.problem.startswith(f"Cannot reach Bunraku at {options.server}")
