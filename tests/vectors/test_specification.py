"""The specification's registries, numbers and links match the code."""

from __future__ import annotations

import hashlib
import json
import re
from pathlib import Path
from typing import Any

import pytest

from bunraku.client.reconnecting_connection import RETRYABLE_CLOSE_CODES
from bunraku.codec.motion_track import MOTION_CODEC
from bunraku.codec.prior import load_shipped_prior
from bunraku.codec.scene import SCENE_CODEC
from bunraku.delivery.resume import ResumeState
from bunraku.websocket import subprotocol
from bunraku.wire.messages import FIXED_MESSAGES, MAP_MESSAGES, MAX_CLIENT_MESSAGE_BYTES, SUBPROTOCOL, Ping
from bunraku.wire.overlay import Overlay
from tests.vectors import asyncapi
from tests.vectors.golden import PROTO_FOLDER, VECTORS_FOLDER

CHAPTERS = ("SPEC", "codec", "messages", "playback", "control", "server", "http", "bus")


def _text(name: str) -> str:
    return (PROTO_FOLDER / f"{name}.md").read_text(encoding="utf-8")


def _section(name: str, number: str) -> str:
    found = re.search(rf"^## {re.escape(number)} .*?(?=^## |\Z)", _text(name), re.M | re.S)
    assert found is not None, number
    return found[0]


def _rows(section: str) -> list[list[str]]:
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in section.splitlines() if line[:1] == "|"]
    return [row for row in rows[2:] if not set(row[0]) <= {"-"}]


def test_registry_of_message_types_matches_the_declarations() -> None:
    listed = {(int(row[0]), row[1], row[2]) for row in _rows(_section("SPEC", "1.7"))}
    declared: set[tuple[int, str, str]] = {(Overlay.MULTI_PERFORMER_TYPE, "Overlay", "server")}
    kinds: tuple[Any, ...] = (*MAP_MESSAGES, *FIXED_MESSAGES)
    for kind in kinds:
        declared.add((kind.TYPE, kind.__name__, "client" if kind.TYPE >= Ping.TYPE else "server"))
    assert listed == declared


def test_registry_of_close_codes_has_every_code_of_the_server_and_client() -> None:
    listed = {int(code) for row in _rows(_section("SPEC", "1.8")) for code in row[0].split(", ")}
    used = {value for name, value in vars(subprotocol).items() if name.isupper() and isinstance(value, int)}
    used.discard(MAX_CLIENT_MESSAGE_BYTES)
    # the client also reconnects without a close code
    assert used | {code for code in RETRYABLE_CLOSE_CODES if code is not None} <= listed


def test_prior_has_the_digest_and_ranges_of_the_text() -> None:
    section = _section("codec", "2.11")
    digest = hashlib.sha256((PROTO_FOLDER / "prior.json").read_bytes()).hexdigest()
    assert f"SHA-256 {digest}" in section
    assert f"`{MOTION_CODEC}`" in section
    assert f"`{SCENE_CODEC}`" in section
    prior = load_shipped_prior()._asdict()
    rows = {row[0].strip("`"): row for row in _rows(section)}
    assert rows.keys() == prior.keys()
    for name, array in prior.items():
        _, shape, _, lowest, highest = rows[name]
        assert shape == " x ".join(map(str, array.shape))
        assert (int(lowest), int(highest)) == (array.min(), array.max())


def test_messages_of_each_connection_match_the_asyncapi_document() -> None:
    types = {name: message["x-type"] for name, message in asyncapi.make_document()["components"]["messages"].items()}
    channels = {address: messages for address, _, messages in asyncapi.CHANNELS.values()}
    for url, _, server, client in _rows(_section("server", "6.1"))[:4]:
        listed = {int(number) for number in f"{server}, {client}".split(", ")} - {Overlay.MULTI_PERFORMER_TYPE}
        assert listed == {types[name] for name in channels[url.strip("`")]}


def test_field_tables_have_every_field_of_the_map_messages() -> None:
    text = _text("messages")
    for name, message in asyncapi.make_document()["components"]["messages"].items():
        for field in message["payload"].get("properties", {}):
            assert f"`{field}`" in text, f"{name}.{field}"


def test_every_vector_file_is_described() -> None:
    section = _section("SPEC", "1.6")
    assert {path.name for path in VECTORS_FOLDER.iterdir()} == set(re.findall(r"`(\w+\.json)`", section))


@pytest.mark.parametrize("name", CHAPTERS)
def test_references_to_sections_exist(name: str) -> None:
    sections = {number for chapter in CHAPTERS for number in re.findall(r"^##? (\d(?:\.\d+)?) ", _text(chapter), re.M)}
    sections.add("1")
    assert sections >= set(re.findall(r"\(([1-8]\.\d+)\)", _text(name)))


def test_asyncapi_document_is_valid_json_with_resolvable_references() -> None:
    document = json.loads((PROTO_FOLDER / "asyncapi.json").read_text(encoding="utf-8"))
    for reference in re.findall(r'"\$ref": "#/([^"]+)"', json.dumps(document)):
        part = document
        for key in reference.split("/"):
            part = part[key]
    assert SUBPROTOCOL in document["info"]["description"]


def test_have_examples_follow_the_grammar_of_the_text() -> None:
    # rules of 6.2 as a regular expression, in the order of the ABNF
    level = "[0-9a-f-]"
    runs = f"{level}(?:{level}|[g-z]){{0,63}}"
    grammar = re.compile(
        rf"[A-Za-z0-9]{{1,64}}\.[0-9]{{1,7}}\.{level}{{1,64}}(?:\.[0-9]{{1,2}}(?:\.[0-9]{{1,7}}\.{runs}){{0,3}})?"
    )
    states = (
        ResumeState("k3v9q", 0, (0,)),
        ResumeState("k3v9q", 86_399, (3, -1, 15), 5),
        ResumeState("k3v9q", 7, (2,) * 64, 12, ((0, (1,) * 40), (3, (-1, 4)), (9, (0,)))),
    )
    for state in states:
        assert grammar.fullmatch(state.to_query())
        assert ResumeState.parse(state.to_query()) == state


def test_specification_has_no_line_of_more_than_130_characters() -> None:
    for path in Path(PROTO_FOLDER).glob("*.md"):
        for line in path.read_text(encoding="utf-8").splitlines():
            assert len(line) <= 130 or line.startswith("|"), f"{path.name}: {line[:60]}"
