"""Generated files by path: golden vectors, AsyncAPI document, names in files and TypeScript message types."""

from __future__ import annotations

import json
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

from tests.vectors import (
    asyncapi,
    audio,
    blocks,
    bonded_stage,
    bonds,
    contacts,
    controlled_limb,
    extension,
    hand_face_names,
    hands_face,
    joint_mapping,
    joint_names,
    live,
    messages,
    one_euro,
    playback,
    props,
    scene,
    skeletons,
    trace,
    typescript,
)

ROOT = Path(__file__).resolve().parents[2]
PROTO_FOLDER = ROOT / "proto"
VECTORS_FOLDER = PROTO_FOLDER / "vectors"
ASYNCAPI_FILE = PROTO_FOLDER / "asyncapi.json"
JOINT_NAMES_FILE = PROTO_FOLDER / "joint_names.json"
HAND_FACE_NAMES_FILE = PROTO_FOLDER / "hand_face_names.json"
TYPESCRIPT_FILE = ROOT / "services" / "web" / "src" / "wire" / "messages.ts"
GENERATORS: dict[str, Callable[[], Any]] = {
    "audio.json": audio.make_vectors,
    "blocks.json": blocks.make_vectors,
    "bonded_stage.json": bonded_stage.make_vectors,
    "bonds.json": bonds.make_vectors,
    "hand_face_names.json": hand_face_names.make_vectors,
    "joint_mapping.json": joint_mapping.make_vectors,
    "live.json": live.make_vectors,
    "messages.json": messages.make_vectors,
    "one_euro.json": one_euro.make_vectors,
    "playback.json": playback.make_vectors,
    "pulled.json": controlled_limb.make_vectors,
    "scene.json": scene.make_vectors,
    "contacts.json": contacts.make_vectors,
    "props.json": props.make_vectors,
    "extension.json": extension.make_vectors,
    "hands_face.json": hands_face.make_vectors,
    "skeletons.json": skeletons.make_vectors,
    "trace.json": trace.make_vectors,
}
_NUMBER_LIST = re.compile(r"\[[-+.\deE,\s]+\]")


def render_vectors(name: str) -> str:
    """Return the text of one vector file; a list of numbers is one line."""
    text = json.dumps(GENERATORS[name](), indent=1, ensure_ascii=False)
    return _NUMBER_LIST.sub(lambda found: re.sub(r"\s+", "", found[0]), text) + "\n"


def render_asyncapi() -> str:
    """Return the text of the AsyncAPI document."""
    return json.dumps(asyncapi.make_document(), indent=1) + "\n"


def render_joint_names() -> str:
    """Return the text of the naming conventions of joints."""
    return json.dumps(joint_names.make_document(), indent=1, ensure_ascii=False) + "\n"


def render_hand_face_names() -> str:
    """Return the text of the words for fingers and expressions."""
    return json.dumps(hand_face_names.make_document(), indent=1, ensure_ascii=False) + "\n"


def render_typescript() -> str:
    """Return the text of the TypeScript message types."""
    return typescript.make_module(asyncapi.make_document())


def render_files() -> dict[Path, str]:
    """Return the text of every generated file except `arm.json`."""
    files = {VECTORS_FOLDER / name: render_vectors(name) for name in GENERATORS}
    return files | {
        ASYNCAPI_FILE: render_asyncapi(),
        JOINT_NAMES_FILE: render_joint_names(),
        HAND_FACE_NAMES_FILE: render_hand_face_names(),
        TYPESCRIPT_FILE: render_typescript(),
    }
