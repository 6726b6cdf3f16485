"""Command that shows what a motion file contains, without a server: `bunraku inspect`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer
from rich.text import Text
from rich.tree import Tree

from bunraku.runtime.display_text import escape_text
from bunraku.terminal import JsonOption, err, out

if TYPE_CHECKING:
    from bunraku.motion.analysis import Analysis
    from bunraku.motion.hands import Hands
    from bunraku.motion.source_motion import SourceMotion

MAX_FILE_BYTES = 64 << 20
MAX_TREE_JOINTS = 200
"""Joints that are printed; JSON has all."""
MAX_EXPRESSIONS = 12
"""Expressions that are printed; JSON has all."""
POOR_JOINT_MM = 25.0
"""Mean distance above which a joint is marked."""


def inspect(
    file: Annotated[Path, typer.Argument(exists=True, dir_okay=False, readable=True)],
    take: Annotated[str | None, typer.Option(help="Motion of a file that has several.")] = None,
    as_json: JsonOption = False,
) -> None:
    """Show the skeleton of a motion file, the joints that were found, how well they fit, and the first pose."""
    from bunraku.motion.analysis import analyse
    from bunraku.motion.errors import UnreadableFile
    from bunraku.motion.readers.motion_file import read_motion

    if file.stat().st_size > MAX_FILE_BYTES:
        err.print(
            f"{file.name} has over {MAX_FILE_BYTES >> 20} MiB, more than a server accepts. Cut it into shorter clips."
        )
        raise typer.Exit(1)
    try:
        source = read_motion(file.read_bytes(), take)
        analysis = analyse(source)
    except UnreadableFile as error:
        err.print(str(error))
        raise typer.Exit(1) from None
    if as_json:
        out.print_json(data=_describe(source, analysis))
    else:
        _print(source, analysis)


def _describe(source: SourceMotion, analysis: Analysis) -> dict[str, Any]:
    """Return everything as JSON has it."""
    return {
        "fps": source.fps,
        "frames": source.frame_count,
        "joints": [
            {"name": name, "parent": source.names[parent] if parent >= 0 else None}
            for name, parent in zip(source.names, source.parents, strict=True)
        ],
        "profile": analysis.profile,
        "mapping": analysis.source_joints,
        "rest_pose": analysis.rest_pose,
        "unit": analysis.unit,
        "fit": {
            "mean_mm": round(analysis.mean_fit_error_mm, 3),
            "max_mm": round(analysis.max_fit_error_mm, 3),
            "joints_mm": {joint: round(each.mean_mm, 3) for joint, each in analysis.joint_fits.items()},
        },
        "extension": _describe_extension(source, analysis),
        "fingers": _describe_fingers(source, analysis),
        "expressions": list(analysis.face.face.names) if analysis.face is not None else [],
        "guessed": analysis.assumptions,
    }


def _describe_extension(source: SourceMotion, analysis: Analysis) -> dict[str, Any] | None:
    """Return the joints of the extension, and the fit with them; None if there is no extension."""
    extension = analysis.extension
    if extension is None:
        return None
    return {
        "joints": dict(
            zip(extension.extension.names, (source.names[joint] for joint in extension.sources), strict=True)
        ),
        "fit": {
            "mean_mm": round(analysis.extended_mean_error_mm, 3),
            "max_mm": round(analysis.extended_max_error_mm, 3),
        },
    }


def _describe_fingers(source: SourceMotion, analysis: Analysis) -> dict[str, Any] | None:
    """Return the joints of the fingers, and their fit; None if no finger moves."""
    hands = analysis.hands
    if hands is None:
        return None
    return {
        "joints": dict(zip(hands.hands.names, (source.names[joint] for joint in hands.sources), strict=True)),
        "fit": {
            "mean_mm": round(analysis.hands_mean_error_mm, 3),
            "max_mm": round(analysis.hands_max_error_mm, 3),
        },
    }


def _print(source: SourceMotion, analysis: Analysis) -> None:
    from bunraku.pose_picture import draw_pose

    motion = analysis.motion
    out.print(_skeleton_tree(source, analysis))
    out.print(Text(draw_pose(motion.figure, motion.root[0], motion.rotations[0])))
    out.print()
    out.print(
        f"{motion.frame_count / motion.fps:.2f} s, {motion.frame_count} frames at {motion.fps:g} fps; "
        f"names: {analysis.profile}; rest pose: {analysis.rest_pose}; unit: {analysis.unit}",
        highlight=False,
    )
    out.print(
        f"fit: {analysis.mean_fit_error_mm:.1f} mm mean, {analysis.max_fit_error_mm:.1f} mm maximum", highlight=False
    )
    if analysis.extension is not None:
        out.print(
            f"with {', '.join(analysis.extension.extension.names)}: {analysis.extended_mean_error_mm:.1f} mm mean, "
            f"{analysis.extended_max_error_mm:.1f} mm maximum",
            highlight=False,
        )
    if analysis.hands is not None:
        out.print(
            f"fingers: {_count_fingers(analysis.hands.hands)}; {analysis.hands_mean_error_mm:.1f} mm mean, "
            f"{analysis.hands_max_error_mm:.1f} mm maximum",
            highlight=False,
        )
    if analysis.face is not None:
        names = analysis.face.face.names
        more = f" and {len(names) - MAX_EXPRESSIONS} more" if len(names) > MAX_EXPRESSIONS else ""
        out.print(f"expressions: {', '.join(names[:MAX_EXPRESSIONS])}{more}", highlight=False)
    for assumption in analysis.assumptions:
        out.print(f"assumed: {assumption}", highlight=False)


def _count_fingers(hands: Hands) -> str:
    """Return how many fingers and joints each hand has."""
    size = len(hands.counts) // 2
    sides = ("left", hands.counts[:size]), ("right", hands.counts[size:])
    return ", ".join(
        f"{side} hand {sum(count > 0 for count in counts)} with {sum(counts)} joints" for side, counts in sides
    )


def _skeleton_tree(source: SourceMotion, analysis: Analysis) -> Tree:
    """Return the joints of the source with the figure's joints that follow them, and their mean distance."""
    mapped: dict[int, tuple[str, float | None]] = {}
    if analysis.extension is not None:
        names = analysis.extension.extension.names
        mapped = {joint: (name, None) for joint, name in zip(analysis.extension.sources, names, strict=True)}
    if analysis.hands is not None:
        fingers = zip(analysis.hands.sources, analysis.hands.hands.names, strict=True)
        mapped |= {joint: (name, None) for joint, name in fingers}
    mapped |= {each.source: (joint, each.mean_mm) for joint, each in analysis.joint_fits.items()}
    root = Tree(_joint_label(source.names[0], mapped.get(0)))
    trees = [root]
    for joint in range(1, min(len(source.names), MAX_TREE_JOINTS)):
        trees.append(trees[source.parents[joint]].add(_joint_label(source.names[joint], mapped.get(joint))))
    if len(source.names) > MAX_TREE_JOINTS:
        root.add(f"and {len(source.names) - MAX_TREE_JOINTS} more")
    return root


def _joint_label(name: str, follower: tuple[str, float | None] | None) -> Text:
    """Return the name of a source joint, and the joint that follows it, if one of the figure with their distance."""
    label = Text(escape_text(name))
    if follower is None:
        label.stylize("dim")
        return label
    joint, mean_mm = follower
    if mean_mm is None:
        return label + Text(f"  {joint}", style="green")
    return label + Text(f"  {joint}  {mean_mm:.1f} mm", style="bold red" if mean_mm > POOR_JOINT_MM else "green")
