from __future__ import annotations

import json
from typing import Any

import lz4.frame
import pytest

from bunraku.capture.errors import UnreadableCapture
from bunraku.capture.rokoko import MAX_JSON_BYTES, RokokoAssembler
from tests.capture.samples import joint_distances_mm, retarget_all, sample_analysis, sample_performance
from tests.capture.world_performers import rokoko_datagrams


def first_frame() -> dict[str, Any]:
    frame: dict[str, Any] = json.loads(rokoko_datagrams(sample_performance())[0])
    return frame


@pytest.mark.parametrize("compressed", [False, True])
def test_poses_are_those_of_the_analysed_clip(compressed: bool) -> None:
    assembler = RokokoAssembler()
    frames = [
        frame
        for datagram in rokoko_datagrams(sample_performance())
        for frame in assembler.feed(lz4.frame.compress(datagram) if compressed else datagram)
    ]
    assert frames[3].sender_time_s == pytest.approx(0.1)
    assert frames[0].blendshapes == {"jawOpen": 0.25}
    figure, poses = retarget_all(RokokoAssembler.skeleton, frames)
    assert joint_distances_mm(figure, poses, sample_analysis()).max() < 0.1


def test_actor_is_chosen_by_name_or_the_first_with_a_body() -> None:
    frame = first_frame()
    actors = frame["scene"]["actors"]
    frame["scene"]["actors"] = [{"name": "camera"}, *actors, {**actors[0], "name": "Bo", "face": {}}]
    datagram = json.dumps(frame).encode()
    assert RokokoAssembler().feed(datagram)[0].blendshapes
    assert not RokokoAssembler("Bo").feed(datagram)[0].blendshapes
    assert RokokoAssembler("Cy").feed(datagram) == []


def test_decompression_bombs_are_rejected() -> None:
    bomb = lz4.frame.compress(bytes(100 * MAX_JSON_BYTES))[:65_507]
    with pytest.raises(UnreadableCapture, match="Damaged LZ4"):
        RokokoAssembler().feed(bomb)
    with pytest.raises(UnreadableCapture, match="Damaged LZ4"):
        RokokoAssembler().feed(lz4.frame.compress(b"{}" * 99)[:-9])
    with pytest.raises(UnreadableCapture, match="Damaged LZ4"):
        RokokoAssembler().feed(b"\x04\x22\x4d\x18" + bytes(40))


@pytest.mark.parametrize(
    ("datagram", "problem"),
    [
        (b"", "Invalid datagram"),
        (b"{", "Not JSON"),
        (b"[" * 60_000, "Not JSON"),
        (b"9" * 5_000, "Not JSON"),
        (b"\xff", "Not JSON"),
        (b"[]", "Unknown version"),
        (b'{"version": 2}', "version: "),
        (b'{"version": 3}', "scene is missing"),
        (b'{"version": 3, "scene": {}}', "actors is missing"),
        (b'{"version": NaN}', "NaN"),
    ],
)
def test_other_data_is_rejected(datagram: bytes, problem: str) -> None:
    with pytest.raises(UnreadableCapture, match=problem):
        RokokoAssembler().feed(datagram)


@pytest.mark.parametrize(
    ("hip", "problem"),
    [
        (3, "hip: it is not an object"),
        ({"position": {"x": 0, "y": 0, "z": 0}}, "hip: rotation is missing"),
        ({"rotation": {"x": 0, "y": 0, "z": 0, "w": 1}}, "hip: position is missing"),
        ({"position": {"x": 0, "y": 0}, "rotation": {"x": 0, "y": 0, "z": 0, "w": 1}}, "hip: position does not"),
        ({"position": {"x": 0, "y": 0, "z": True}, "rotation": {"x": 0, "y": 0, "z": 0, "w": 1}}, "position does not"),
        ({"position": {"x": 1e9, "y": 0, "z": 0}, "rotation": {"x": 0, "y": 0, "z": 0, "w": 1}}, "not within"),
        ({"position": {"x": 10**400, "y": 0, "z": 0}, "rotation": {"x": 0, "y": 0, "z": 0, "w": 1}}, "too large"),
        ({"position": {"x": 0, "y": 0, "z": 0}, "rotation": {"x": 0, "y": 0, "z": 0, "w": 2}}, "length 1"),
    ],
)
def test_invalid_joints_are_rejected(hip: Any, problem: str) -> None:
    frame = first_frame()
    frame["scene"]["actors"][0]["body"]["hip"] = hip
    with pytest.raises(UnreadableCapture, match=problem):
        RokokoAssembler().feed(json.dumps(frame).encode())


def test_absent_joints_are_allowed_but_not_a_body_without_any() -> None:
    frame = first_frame()
    body = frame["scene"]["actors"][0]["body"]
    body["head"] = None
    (captured,) = RokokoAssembler().feed(json.dumps(frame).encode())
    assert "Head" not in captured.rotations
    body.clear()
    with pytest.raises(UnreadableCapture, match="No joints"):
        RokokoAssembler().feed(json.dumps(frame).encode())
