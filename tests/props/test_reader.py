from __future__ import annotations

import numpy as np
import pytest

from bunraku.ingest.jobs.image_file import decode_image
from bunraku.motion.errors import UnreadableFile
from bunraku.props.placing import Grip
from bunraku.props.reader import DETAIL_TRIANGLES, read_prop
from tests.props.samples import Asset, box_glb, image_file, picture_glb


def test_box_becomes_a_prop_with_its_colour_and_form() -> None:
    model, guessed = read_prop(box_glb(), decode_image)
    assert (model.size, guessed, len(model.triangles)) == ([0.05, 0.6, 0.05], [], 12)
    # flat faces: each has corners of its own
    assert len(model.positions) == 24
    assert model.looks == pytest.approx(np.tile([0.45, 0.03, 0.014, 1.0, 0.6, 0.0, 0.0], (24, 1)), abs=0.003)
    assert [model.form.pitch, model.form.palm_offset] == pytest.approx([np.pi / 2, 0.0])


def test_picture_becomes_colours_of_corners() -> None:
    pixels = np.zeros((128, 128, 3), dtype=np.uint8)
    pixels[:, 64:] = (255, 255, 255)
    model, _ = read_prop(picture_glb(image_file(pixels)), decode_image)
    assert 2 < len(model.triangles) <= DETAIL_TRIANGLES
    left, right = model.positions[:, 0] < -0.02, model.positions[:, 0] > 0.02
    assert model.looks[left, :3].max() == 0.0
    assert model.looks[right, :3].min() == 1.0


def test_wanted_length_and_grip_are_kept() -> None:
    model, guessed = read_prop(box_glb(5.0, 60.0, 5.0, 100.0), decode_image, 1.2, Grip.BOTTOM)
    assert (model.size, guessed) == ([0.1, 1.2, 0.1], [])
    assert model.positions[:, 1].min() == 0.0


def test_noise_on_many_surfaces_stays_within_the_limit_of_triangles() -> None:
    noise = np.random.default_rng(3).integers(0, 255, (256, 256, 3), dtype=np.uint8)
    asset = Asset()
    texture = asset.add_image(image_file(noise))
    material = asset.add_material(pbrMetallicRoughness={"baseColorTexture": {"index": texture}}, doubleSided=True)
    corners = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]])
    at = np.array([[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]], dtype="<f4")
    mesh = asset.add_mesh(corners, np.array([[0, 1, 2], [0, 2, 3]]), material, TEXCOORD_0=at)
    for place in range(40):
        asset.add_node(mesh=mesh, translation=[0, 0, place / 40])
    model, _ = read_prop(asset.pack(), decode_image)
    assert 6_000 < len(model.triangles) <= DETAIL_TRIANGLES
    assert len(model.positions) < 65_536


@pytest.mark.parametrize("data", [b"", b"glTF", b"{}", b"[]", box_glb()[:-20], b"\0" * 4000])
def test_other_files_are_refused(data: bytes) -> None:
    with pytest.raises(UnreadableFile) as raised:
        read_prop(data, decode_image)
    assert raised.value.hint


def test_surface_without_area_is_refused() -> None:
    with pytest.raises(UnreadableFile, match="no area"):
        read_prop(box_glb(0.0, 0.6, 0.0), decode_image)
