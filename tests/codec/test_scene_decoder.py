from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from bunraku.codec.errors import DamagedBlock
from bunraku.codec.scene_decoder import decode_scene_block
from bunraku.codec.scene_encoder import EncodedScene, encode_scene
from tests.vectors.scene import sample_camera, sample_light

SCENES = [encode_scene(make(2.0, 30.0), error_bounds_mm=(4.0,)) for make in (sample_camera, sample_light)]


def test_block_can_be_evaluated_between_frames() -> None:
    for make, scene in zip((sample_camera, sample_light), SCENES, strict=True):
        instants = np.arange(8, 8 * 29) / 8.0
        values = decode_scene_block(scene.track, scene.ladder[0].blocks[0]).values_at(instants)
        oversampled = make(2.0, 240.0).values[8 : 8 * 29]
        error = scene.track.to_channels(values) - scene.track.to_channels(oversampled)
        assert np.linalg.norm(error, axis=-1).max() < 0.01


@given(st.sampled_from(SCENES), st.data())
def test_damaged_block_is_decoded_or_refused(scene: EncodedScene, data: st.DataObject) -> None:
    track, valid = scene.track, scene.ladder[0].blocks[1]
    damaged = bytearray(valid)
    bit = data.draw(st.integers(0, len(valid) * 8 - 1))
    damaged[bit // 8] ^= 1 << bit % 8
    for broken in (bytes(damaged), valid[: data.draw(st.integers(0, len(valid)))], data.draw(st.binary(max_size=400))):
        try:
            block = decode_scene_block(track, broken)
        except DamagedBlock:
            continue
        assert 1 <= block.frames <= 512
        values = block.values_at(np.array([-0.5, 0.0, block.frames - 0.5]))
        assert values.shape == (3, 7)
        assert np.isfinite(values).all()
