"""Reader of FBX animations, binary and ASCII, by ufbx (https://github.com/ufbx/ufbx, S. Raivio)."""

from __future__ import annotations

import ctypes
import gc
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

import numpy as np
import ufbx

from bunraku.motion import rotation
from bunraku.motion.errors import UnreadableFile, quote_excerpt
from bunraku.motion.readers.node_motion import (
    Node,
    NodeMotion,
    Track,
    check_shape_frames,
    choose_rate,
    sample_nodes,
)
from bunraku.motion.readers.takes import choose_take, describe_choice, name_takes
from bunraku.motion.rotation import Array

MAX_NODES = 1_000
MAX_VALUE = 1e12
"""Largest translation and scale, in any unit: products of larger ones would overflow."""
SPAN_TOLERANCE_S = 1e-3
"""Keys this near to a take's span belong to it."""
_LOAD_OPTIONS: dict[str, Any] = {
    "file_format": ufbx.FileFormat.FBX,
    "ignore_geometry": True,
    "ignore_embedded": True,
    "node_depth_limit": 256,
    # bones that do not inherit the scale above them get its inverse
    "inherit_mode_handling": ufbx.InheritModeHandling.COMPENSATE,
}
_CONVERSION_OPTIONS: dict[str, Any] = {
    "target_axes": ufbx.axes_right_handed_y_up,
    "handedness_conversion_axis": ufbx.MirrorAxis.X,
}
"""Options for files in left-handed axes, in which the body would be its mirror image."""
_Keep = Callable[[Any], Any]
_BONELESS = {ufbx.ElementType.MESH, ufbx.ElementType.CAMERA, ufbx.ElementType.LIGHT}


def parse_fbx(data: bytes, take: str | None = None) -> NodeMotion:
    """Parse the take (animation stack) `take` of an FBX file, by default the one that moves most.

    Raises `UnreadableFile` if the data is not an FBX file or has no such take. A file that crashes ufbx ends the
    process: parse in a separate process.
    """
    with _uncollected() as keep:
        scene = _load_scene(data, keep)
        if _is_left_handed(keep(keep(scene.settings).axes)):
            scene = _load_scene(data, keep, **_CONVERSION_OPTIONS)
        stacks = [keep(stack) for stack in keep(scene.anim_stacks)]
        if not stacks:
            raise UnreadableFile(
                "No animation", "the file has a model, but no animation", hint="export it with its animation"
            )
        curves = [_moving_curves(stack, keep) for stack in stacks]
        names = _take_names(stacks)
        chosen = choose_take(names, [len(moving) for moving in curves], take)
        times = [np.array([key.time for key in keep(curve.keyframes)]) for curve in curves[chosen]]
        if not times:
            detail = f"the take {quote_excerpt(names[chosen])} moves nothing"
            hint = "export it with the animation of its joints"
            raise UnreadableFile("Nothing moves", detail, field=names[chosen], hint=hint)
        start, end = _find_span(stacks[chosen], times)
        nodes, elements = _read_nodes(scene, keep)
        if len(nodes) < 2:
            detail = "none of its objects is a joint"
            raise UnreadableFile("No skeleton", detail, hint="export it with its skeleton (armature, bones)")
        notes = [*describe_choice(names, chosen), *_describe_muted_layers(stacks[chosen], keep)]
        unit = _read_unit(keep(scene.settings), keep)
        motion = sample_nodes(nodes, start, end, choose_rate(times), notes, unit)
        animation = keep(stacks[chosen].anim)
        _sample_tracks(animation, motion, elements)
        shapes = _find_blend_shapes(scene, stacks[chosen], keep)
        return replace(motion, expressions=_sample_blend_shapes(animation, motion, shapes))


def list_fbx_takes(data: bytes) -> list[str]:
    """Return the names of a file's takes. Raises `UnreadableFile` if the data is not an FBX file.

    A file that crashes ufbx ends the process.
    """
    with _uncollected() as keep:
        return _take_names([keep(stack) for stack in keep(_load_scene(data, keep).anim_stacks)])


def _load_scene(data: bytes, keep: _Keep, **options: Any) -> ufbx.Scene:
    try:
        return keep(ufbx.load_memory(data, **_LOAD_OPTIONS, **options))
    except (ufbx.UfbxError, ValueError) as error:
        detail = str(error) or type(error).__name__
        raise UnreadableFile("Broken FBX file", detail, hint="export it again, as FBX 2014 or later") from error


def _take_names(stacks: Sequence[ufbx.AnimStack]) -> list[str]:
    return name_takes(stack.name or f"take {number}" for number, stack in enumerate(stacks, 1))


@contextmanager
def _uncollected() -> Iterator[_Keep]:
    """Give a function that returns an object of ufbx and keeps it for ever; exempt all objects from garbage collection.

    In ufbx 0.0.5, objects do not count their references to the scene: the garbage collector and the end of an object
    free memory that is in use.
    """

    def keep(item: Any) -> Any:
        ctypes.pythonapi.Py_IncRef(ctypes.py_object(item))
        return item

    was_enabled = gc.isenabled()
    gc.disable()
    try:
        yield keep
    finally:
        gc.freeze()
        if was_enabled:
            gc.enable()


def _is_left_handed(axes: ufbx.CoordinateAxes) -> bool:
    """Return whether axes, of which each is one of 0..5 for x, -x, y, -y, z and -z or unknown, are left-handed."""
    numbers = [int(axes.right), int(axes.up), int(axes.front)]
    if {number // 2 for number in numbers} != {0, 1, 2}:
        return False
    matrix = np.zeros((3, 3))
    for row, number in enumerate(numbers):
        matrix[row, number // 2] = -1.0 if number % 2 else 1.0
    return bool(np.linalg.det(matrix) < 0.0)


def _describe_muted_layers(stack: ufbx.AnimStack, keep: _Keep) -> list[str]:
    """Return a sentence about each muted layer that has curves: ufbx evaluates them, too."""
    return [
        f"The layer {quote_excerpt(layer.name)} is muted in the file, but was read."
        for layer in [keep(layer) for layer in keep(stack.layers)]
        if len(keep(layer.anim_props)) > 0
        and any(
            prop.name == "Mute" and prop.value_int for prop in [keep(each) for each in keep(keep(layer.props).props)]
        )
    ]


def _read_unit(settings: ufbx.SceneSettings, keep: _Keep) -> float | None:
    """Return the metres per unit that the file declares, None if it does not."""
    declared = {keep(prop).name for prop in keep(keep(settings.props).props)}
    unit = settings.unit_meters
    return unit if "UnitScaleFactor" in declared and np.isfinite(unit) and unit > 0.0 else None


def _moving_curves(stack: ufbx.AnimStack, keep: _Keep) -> list[ufbx.AnimCurve]:
    """Return the curves of a take that have keys."""
    found = []
    for layer in keep(stack.layers):
        for prop in keep(keep(layer).anim_props):
            curves = keep(keep(keep(prop).anim_value).curves)
            found += [keep(curve) for curve in curves if curve is not None and len(keep(curve.keyframes)) > 0]
    return found


def _find_span(stack: ufbx.AnimStack, key_times: Sequence[Array]) -> tuple[float, float]:
    """Return first and last key of a take in seconds: within its own span, unless that has no keys."""
    keys = np.unique(np.concatenate(key_times))
    within = keys[(keys >= stack.time_begin - SPAN_TOLERANCE_S) & (keys <= stack.time_end + SPAN_TOLERANCE_S)]
    chosen = within if len(within) > 1 else keys
    return float(chosen[0]), float(chosen[-1])


def _read_nodes(scene: ufbx.Scene, keep: _Keep) -> tuple[list[Node], list[ufbx.Node]]:
    """Return the nodes that may be joints, with their ancestors, parents first, and what they are in the file."""
    everything = [keep(node) for node in keep(scene.nodes)]
    parents = [-1 if node.parent is None else keep(node.parent).typed_id for node in everything]
    kept: set[int] = set()
    for number, node in enumerate(everything):
        above = -1 if node.attrib_type in _BONELESS else number
        while above >= 0 and above not in kept:
            kept.add(above)
            above = parents[above]
    if len(kept) > MAX_NODES:
        raise UnreadableFile("Too many joints", f"over {MAX_NODES:,} joints", hint="export the body's joints only")
    order = sorted(kept, key=lambda number: (everything[number].node_depth, number))
    place = {number: index for index, number in enumerate(order)}
    nodes = []
    for number in order:
        name = everything[number].name or ("scene" if parents[number] < 0 else f"node {number}")
        nodes.append(Node(name, place.get(parents[number], -1), *_as_arrays(everything[number].local_transform)))
    return nodes, [everything[number] for number in order]


def _sample_tracks(animation: ufbx.Anim, motion: NodeMotion, elements: Sequence[ufbx.Node]) -> None:
    """Give each node of `motion` its transforms in all frames as tracks."""
    times = motion.times
    for node, element in zip(motion.nodes, elements, strict=True):
        sampled = np.array(
            [
                (*each.translation, *each.rotation, *each.scale)
                for each in (ufbx.evaluate_transform(animation, element, time) for time in times.tolist())
            ]
        )
        if not (np.abs(sampled) <= MAX_VALUE).all():
            raise UnreadableFile(
                "Broken FBX file",
                f"its animation has values that are no numbers, or beyond {MAX_VALUE:.0e}",
                field=node.name,
                hint="the export went wrong; export it again, or cut the part that is performed",
            )
        node.tracks["translation"] = Track(times, sampled[:, :3])
        node.tracks["rotation"] = Track(times, rotation.normalise(sampled[:, [6, 3, 4, 5]]))
        node.tracks["scale"] = Track(times, sampled[:, 7:])


def _find_blend_shapes(scene: ufbx.Scene, stack: ufbx.AnimStack, keep: _Keep) -> list[ufbx.BlendChannel]:
    """Return the blend shapes whose weight a take animates, in the order of the file."""
    moved = {
        keep(keep(prop).element).element_id
        for layer in [keep(layer) for layer in keep(stack.layers)]
        for prop in keep(layer.anim_props)
        if keep(prop).prop_name == "DeformPercent"
    }
    return [channel for channel in [keep(each) for each in keep(scene.blend_channels)] if channel.element_id in moved]


def _sample_blend_shapes(
    animation: ufbx.Anim, motion: NodeMotion, channels: Sequence[ufbx.BlendChannel]
) -> dict[str, Array]:
    """Return the weights (n,) of blend shapes in all frames; the largest of those with the same name."""
    check_shape_frames(motion.frame_count, len(channels))
    found: dict[str, Array] = {}
    for number, channel in enumerate(channels):
        name = channel.name or f"blend shape {number}"
        weights = np.array([ufbx.evaluate_blend_weight(animation, channel, time) for time in motion.times.tolist()])
        if not (np.abs(weights) <= MAX_VALUE).all():
            raise UnreadableFile(
                "Broken FBX file",
                f"a weight is no number, or beyond {MAX_VALUE:.0e}",
                field=name,
                hint="the export went wrong; export it again, or without blend shapes",
            )
        found[name] = np.maximum(found[name], weights) if name in found else weights
    return found


def _as_arrays(transform: ufbx.Transform) -> tuple[Array, Array, Array]:
    """Return translation (3,), rotation (4,), w x y z, and scale (3,)."""
    x, y, z, w = transform.rotation
    return np.array(transform.translation), np.array([w, x, y, z]), np.array(transform.scale)
