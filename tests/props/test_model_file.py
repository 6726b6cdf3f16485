from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bunraku.motion.readers.gltf_file import parse_gltf_file
from bunraku.props.model_file import PropModel, weld_model, write_model
from bunraku.props.placing import PropForm
from tests.props.samples import box

FORM = PropForm(0.5, 0.25, 0.125)


def model_of(size: float = 0.5) -> PropModel:
    positions, triangles = box(size, size, size)
    corners = positions[triangles.reshape(-1)]
    looks = np.tile([0.2, 0.4, 0.6, 0.3, 0.8, 0.1, 0.5], (36, 1))
    normals = np.tile([0.0, 1.0, 0.0], (36, 1))
    return PropModel(corners, normals, looks, np.arange(36).reshape(-1, 3), FORM)


def test_equal_corners_are_kept_once_and_nothing_moves_farther_than_the_rounding() -> None:
    model = weld_model(model_of())
    assert (len(model.positions), len(model.triangles)) == (8, 12)
    welded = model.positions[model.triangles]
    assert np.abs(welded - model_of().positions[model_of().triangles]).max() <= 2.0**-14
    # in the order of their use
    assert [int(each) for each in dict.fromkeys(model.triangles.reshape(-1).tolist())] == list(range(8))
    assert model.size == [0.5, 0.5, 0.5]


def test_triangles_without_an_area_and_their_corners_are_left_out() -> None:
    model = model_of()
    thin = PropModel(model.positions * [1.0, 1.0, 0.0], model.normals, model.looks, model.triangles, FORM)
    assert len(weld_model(thin).triangles) == 4
    nothing = weld_model(PropModel(model.positions * 0.0, model.normals, model.looks, model.triangles, FORM))
    assert (len(nothing.positions), len(nothing.triangles)) == (0, 0)


def test_file_has_the_values_of_the_model() -> None:
    model = weld_model(model_of())
    file = parse_gltf_file(write_model(model))
    (primitive,) = file.item("meshes", 0)["primitives"]
    attributes = primitive["attributes"]
    assert np.array_equal(file.read_accessor(attributes["POSITION"], 3), model.positions)
    assert np.array_equal(file.read_accessor(attributes["NORMAL"], 3), model.normals)
    assert file.read_accessor(attributes["COLOR_0"], 4) == pytest.approx(model.looks[:, :4], abs=1e-5)
    assert file.read_accessor(attributes["_FINISH"], 4)[:, :3] == pytest.approx(model.looks[:, 4:])
    assert np.array_equal(file.read_accessor(primitive["indices"], 1).reshape(-1, 3), model.triangles)
    assert file.item("nodes", 0)["extras"] == {"pitch": 0.5, "height": 0.25, "palmOffset": 0.125}
    # what is not drawn is opaque
    assert (file.read_accessor(attributes["COLOR_0"], 4)[:, 3] == 1.0).all()
    (low, high) = (file.item("accessors", 0)[name] for name in ("min", "max"))
    assert np.array_equal([low, high], [model.positions.min(axis=0), model.positions.max(axis=0)])


@given(st.floats(0.02, 4.0))
def test_equal_models_have_equal_bytes_whatever_the_order_of_corners(size: float) -> None:
    model = model_of(size)
    order = np.random.default_rng(1).permutation(36)
    place = np.argsort(order)
    shuffled = PropModel(model.positions[order], model.normals, model.looks, place[model.triangles], FORM)
    assert write_model(weld_model(shuffled)) == write_model(weld_model(model))
