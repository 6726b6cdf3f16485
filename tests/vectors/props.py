"""Props: tracks, blocks, the props of motion times, and models of stored props (`props.json`)."""

from __future__ import annotations

import struct
from typing import Any

import numpy as np

from bunraku.codec.extension.props import (
    EncodedProps,
    PropTrack,
    ShownState,
    decode_prop_block,
    describe_prop_track,
    encode_props,
    parse_prop_track,
    shift_limb,
)
from bunraku.codec.timing import Timing
from bunraku.ingest.jobs.image_file import decode_image
from bunraku.motion.placement import Placement
from bunraku.playout.block_store import PropBlockStore
from bunraku.props.model_file import write_model
from bunraku.props.reader import read_prop
from bunraku.wire.prop import PropState
from tests.props.samples import Asset, box
from tests.vectors.blocks import to_base64

_FLOOR, _BACK = PropState(None, Placement(0.5, -0.25, 1.5)), PropState(None, Placement(-99.5, 100.0, -3.125))


def _encoded() -> list[EncodedProps]:
    passed: list[ShownState] = [*[None] * 7, *[_FLOOR] * 20, *[PropState(1)] * 30, *[PropState(4)] * 20, *[_BACK] * 13]
    held: list[ShownState] = [PropState(13)] * 90
    return [
        encode_props(["fan", "later"], [passed, held], Timing(30.0, 90, 30, 15)),
        encode_props(["ball"], [[*[PropState(0)] * 499, *[None] * 201]], Timing(120.0, 700, 300, 100), 1),
        encode_props(["umbrella"] * 8, [[_FLOOR]] * 8, Timing(23.976, 1, 1, 1)),
    ]


def state_values(state: ShownState) -> list[Any] | None:
    """Return limb and place of a state, None while it is not on the stage."""
    return None if state is None else [state.limb, list(state.place)]


def _runs(states: tuple[ShownState, ...]) -> list[list[Any]]:
    """Return the first frame of each run of equal states, and the state."""
    starts = [frame for frame, state in enumerate(states) if frame == 0 or state != states[frame - 1]]
    return [[frame, state_values(states[frame])] for frame in starts]


def block_vector(track: PropTrack, number: int, index: int, data: bytes) -> dict[str, Any]:
    """Return a valid block of track `number` with the runs of its props."""
    block = decode_prop_block(data, len(track.kinds), track.frames_in(index))
    return {
        "track": number,
        "index": index,
        "block": to_base64(data),
        "frames": block.frames,
        "runs": list(map(_runs, block.states)),
    }


def position_vectors(number: int, store: PropBlockStore) -> list[dict[str, Any]]:
    """Return the states of the props, with the stage's limbs, at the borders of frames and between them."""
    track = store.track
    frames = sorted({*range(0, track.frames, max(track.frames // 9, 1)), track.first_frames, track.frames - 1})
    positions = [
        max(round(instant * 1e6 / track.fps) + shift, 0)
        for frame in frames
        for instant, shift in ((frame, -2), (frame, 0), (frame + 0.7, 0))
    ]
    return [
        {
            "track": number,
            "position": position,
            "states": [state_values(shift_limb(state, track.performer)) for state in states],
        }
        for position in positions
        if (states := store.states_at(position)) is not None
    ]


def load_track(description: dict[str, Any]) -> PropTrack:
    """Return the track of a golden description."""
    return parse_prop_track(description)


def model_vectors() -> list[dict[str, Any]]:
    """Return models of props as they are served, with their values."""
    vectors = []
    for name, width, bottom in (("staff", 0.05, -0.1), ("crate", 0.5, -0.25)):
        asset = Asset()
        factors = {"baseColorFactor": [0.45, 0.03, 0.014, 1.0], "metallicFactor": 0.3, "roughnessFactor": 0.6}
        material = asset.add_material(pbrMetallicRoughness=factors)
        mesh = asset.add_mesh(*box(width, 0.61, width * 0.9, bottom), material)
        asset.add_node(mesh=mesh, rotation=[0.0, 0.6, 0.0, 0.8])
        model, _ = read_prop(asset.pack(), decode_image)
        colours = np.rint(model.looks[:, :3] * 65535.0) / 65535.0
        vectors.append(
            {
                "name": name,
                "model": to_base64(write_model(model)),
                "pitch": model.form.pitch,
                "height": model.form.height,
                "palmOffset": model.form.palm_offset,
                "positions": model.positions.reshape(-1).tolist(),
                "normals": model.normals.reshape(-1).tolist(),
                "colours": colours.reshape(-1).tolist(),
                "finishes": model.looks[:, 4:].reshape(-1).tolist(),
                "indices": model.triangles.reshape(-1).tolist(),
            }
        )
    return vectors


def make_vectors() -> dict[str, Any]:
    """Return tracks, their blocks, states at motion times, models, and invalid blocks and descriptions."""
    encoded, valid, positions = _encoded(), [], []
    for number, each in enumerate(encoded):
        store = PropBlockStore(each.track)
        for index, block in enumerate(each.ladder[0].blocks):
            valid.append(block_vector(each.track, number, index, block))
            store.put_encoded(index, 0, block)
        positions += position_vectors(number, store)
    held = bytes([30, 3])
    place = struct.Struct("<3f").pack
    invalid = {
        "no runs": b"",
        "no runs of the second prop": held,
        "a run beyond the block": bytes([31, 0]) + held,
        "an empty run": bytes([0, 0, 30, 0]) + held,
        "a run without a state": bytes([30]),
        "a byte after the last run": held + held + b"\0",
        "a leg": bytes([30, 4]) + held,
        "a limb past the last": bytes([30, 18]) + held,
        "a place that ends": held + bytes([30, 1]) + bytes(11),
        "a place that is not a number": bytes([30, 1]) + place(0, 0, float("nan")) + held,
        "a place beyond the stage": bytes([30, 1]) + place(0, -100.5, 0) + held,
    }
    changes: dict[str, dict[str, Any]] = {
        "another codec": {"codec": "bunraku.prop/9"},
        "negative performer": {"performer": -1},
        "no kinds": {"kinds": []},
        "nine kinds": {"kinds": ["fan"] * 9},
        "a kind that is a number": {"kinds": [1]},
        "no frames": {"frames": 0},
    }
    described = describe_prop_track(encoded[0].track, encoded[0].describe()["rates"])
    return {
        "tracks": [each.describe() for each in encoded],
        "valid": valid,
        "positions": positions,
        "models": model_vectors(),
        "invalid": [{"why": why, "block": to_base64(data), "index": 1} for why, data in invalid.items()],
        "invalid_tracks": [{"why": why, "track": described | change} for why, change in changes.items()],
    }
