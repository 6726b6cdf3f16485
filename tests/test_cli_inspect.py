from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from typer.testing import CliRunner

from bunraku import cli_inspect
from bunraku.cli import app
from bunraku.motion.readers.bvh import parse_bvh
from tests.motion.extended_source import write_source_bvh
from tests.motion.hand_source import hand_source
from tests.motion.readers.faces import build_face_fbx
from tests.motion.readers.fbx_tree import to_binary
from tests.motion.readers.fbx_writer import write_fbx
from tests.motion.synthetic_motion import export_bvh, smooth_motion

RUN = CliRunner()


@pytest.fixture
def dance(tmp_path: Path) -> Path:
    path = tmp_path / "dance.bvh"
    path.write_bytes(export_bvh(smooth_motion(frames=20)))
    return path


def test_skeleton_mapping_fit_and_pose_are_shown(dance: Path) -> None:
    shown = RUN.invoke(app, ["inspect", str(dance)])
    assert shown.exit_code == 0, shown.output
    assert "l_knee  l_knee  0.0 mm" in shown.stdout
    assert "20 frames at 30 fps" in shown.stdout
    assert "names: H-Anim 1" in shown.stdout
    assert "assumed: The unit is cm" in shown.stdout
    # the picture
    assert any(0x2800 < ord(character) < 0x2900 for character in shown.stdout)


def test_json_has_everything(dance: Path) -> None:
    document = json.loads(RUN.invoke(app, ["inspect", str(dance), "--json"]).stdout)
    assert document["joints"][1] == {"name": "sacroiliac", "parent": "humanoid_root"}
    assert document["mapping"]["r_wrist"] == "r_wrist"
    assert document["fit"]["joints_mm"]["l_elbow"] < 1.0
    assert (document["fps"], document["frames"], document["unit"]) == (30.0, 20, "cm")


def test_fingers_and_expressions_are_shown(tmp_path: Path) -> None:
    path = tmp_path / "performer.fbx"
    source = parse_bvh(write_source_bvh(hand_source(20)))
    weights = np.linspace(0.0, 1.0, 20)
    path.write_bytes(to_binary(build_face_fbx(source, {"jawOpen": weights, "tail": weights})))
    shown = RUN.invoke(app, ["inspect", str(path)])
    assert shown.exit_code == 0, shown.output
    assert "LeftHandIndex1  l_metacarpophalangeal_2" in shown.stdout
    assert "fingers: left hand 5 with 15 joints, right hand 5 with 15 joints; 0." in shown.stdout
    assert "expressions: jawOpen" in shown.stdout
    assert "left out: 'tail'" in shown.stdout
    document = json.loads(RUN.invoke(app, ["inspect", str(path), "--json"]).stdout)
    assert document["fingers"]["joints"]["r_metacarpophalangeal_5"] == "RightHandPinky1"
    assert document["fingers"]["fit"]["mean_mm"] < 1.0
    assert document["expressions"] == ["jawOpen"]


def test_file_without_fingers_and_face_says_so_in_json(dance: Path) -> None:
    document = json.loads(RUN.invoke(app, ["inspect", str(dance), "--json"]).stdout)
    assert (document["fingers"], document["expressions"]) == (None, [])


def test_take_is_chosen(tmp_path: Path) -> None:
    path = tmp_path / "takes.fbx"
    path.write_bytes(write_fbx(takes=("walk", "run")))
    assert "'run' was read" in RUN.invoke(app, ["inspect", str(path), "--take", "run"]).stdout
    refused = RUN.invoke(app, ["inspect", str(path), "--take", "jump"])
    assert (refused.exit_code, "'walk', 'run'" in refused.output) == (1, True)


def test_unreadable_file_is_explained(tmp_path: Path) -> None:
    path = tmp_path / "notes.txt"
    path.write_bytes(b"hello")
    refused = RUN.invoke(app, ["inspect", str(path)])
    assert refused.exit_code == 1
    assert "Not a BVH file: line 1" in refused.output


def test_too_large_file_is_not_read(dance: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cli_inspect, "MAX_FILE_BYTES", 10)
    refused = RUN.invoke(app, ["inspect", str(dance)])
    assert (refused.exit_code, "Cut it into shorter clips" in refused.output) == (1, True)


def test_names_of_a_file_do_not_control_the_terminal(tmp_path: Path) -> None:
    path = tmp_path / "dance.bvh"
    path.write_bytes(export_bvh(smooth_motion(frames=5)).replace(b"JOINT vl5", b"JOINT \x1b[2J[red]"))
    shown = RUN.invoke(app, ["inspect", str(path)])
    assert shown.exit_code == 0, shown.output
    assert "\x1b[2J" not in shown.stdout
    assert "[red]" in shown.stdout
