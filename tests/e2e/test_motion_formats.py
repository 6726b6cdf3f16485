"""Motion files of several formats, uploaded to a server."""

from __future__ import annotations

from pathlib import Path

import pytest

from bunraku.client.api import Client
from bunraku.client.server_problem import ServerProblem
from bunraku.motion.readers.bvh import parse_bvh
from tests.motion.readers.fbx_writer import write_fbx
from tests.motion.readers.sources import write_acclaim, write_glb, write_zip
from tests.motion.synthetic_motion import export_bvh, smooth_motion

SOURCE = parse_bvh(export_bvh(smooth_motion(frames=40)))
_, AMC = write_acclaim(SOURCE, SOURCE.names)
FILES = {
    "dance.fbx": write_fbx(),
    "dance.glb": write_glb(SOURCE),
    "renamed.bvh": write_glb(SOURCE, scale=0.01),
    "clips.zip": write_zip({"a/dance.bvh": export_bvh(smooth_motion(frames=30)), "b.fbx": write_fbx()}),
}


@pytest.mark.parametrize("name", FILES)
async def test_files_are_read_by_their_content(name: str, server: str, tmp_path: Path) -> None:
    path = tmp_path / name
    path.write_bytes(FILES[name])
    async with Client(server) as client:
        motion = await client.upload(path)
        assert motion["name"] == path.stem
        assert motion["joints"]["l_knee"] == "l_knee"
        assert motion["fit"]["mean_mm"] < 1.0


async def test_takes_of_a_file_are_motions_of_their_own(server: str, tmp_path: Path) -> None:
    path = tmp_path / "takes.fbx"
    path.write_bytes(write_fbx(takes=("walk", "run")))
    async with Client(server) as client:
        first, walk, run = [await client.upload(path, take=take) for take in (None, "walk", "run")]
        assert len({first["id"], walk["id"], run["id"]}) == 3
        assert [motion["name"] for motion in (first, walk, run)] == [
            "takes",
            "takes \N{EN DASH} walk",
            "takes \N{EN DASH} run",
        ]
        assert "Of 2 takes, 'walk' was read; the others are 'run'." in first["guessed"]
        assert (await client.upload(path, take="run"))["id"] == run["id"]
        with pytest.raises(ServerProblem, match="no take 'jump'") as caught:
            await client.upload(path, take="jump")
        assert caught.value.status == 422


async def test_all_takes_of_a_file_become_motions(server: str, tmp_path: Path) -> None:
    path = tmp_path / "all.zip"
    path.write_bytes(
        write_zip(
            {
                "a.fbx": write_fbx(takes=("walk", "run")),
                "b.bvh": export_bvh(smooth_motion(frames=25)),
                "c.bvh": b"HIERARCHY\nROOT hips\n{\n",
                "pose.bvh": export_bvh(smooth_motion(frames=1)),
            }
        )
    )
    async with Client(server) as client:
        stored = await client.upload_takes(path)
        names = [motion["name"].removeprefix("all \N{EN DASH} ") for motion in stored["items"]]
        assert names == ["a.fbx/walk", "a.fbx/run", "b.bvh"]
        assert [(skipped["take"], skipped["title"]) for skipped in stored["skipped"]] == [
            ("c.bvh", "No motion"),
            ("pose.bvh", "Nothing moves"),
        ]
        assert stored["skipped"][0]["line"] == 4
        assert stored["pending"] == []
        assert (await client.upload_takes(path))["items"] == stored["items"]
        assert (await client.upload(path, take="b.bvh"))["id"] == stored["items"][2]["id"]


async def test_file_of_one_motion_has_one_take(server: str, tmp_path: Path) -> None:
    path = tmp_path / "single.bvh"
    path.write_bytes(export_bvh(smooth_motion(frames=26)))
    async with Client(server) as client:
        stored = await client.upload_takes(path)
        assert [motion["name"] for motion in stored["items"]] == ["single"]
        assert stored["items"] == [await client.upload(path)]


async def test_skeleton_without_motion_is_refused_with_a_hint(server: str, tmp_path: Path) -> None:
    path = tmp_path / "dance.amc"
    path.write_bytes(AMC)
    async with Client(server) as client:
        with pytest.raises(ServerProblem, match="AMC file has no skeleton") as caught:
            await client.upload(path)
        assert "zip" in str(caught.value.body["hint"])
