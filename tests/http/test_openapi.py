from __future__ import annotations

import json

from pydantic import BaseModel

from bunraku.http.openapi import request_body
from bunraku.ingest.keyframe import Staging


class Point(BaseModel):
    x: float


class Line(BaseModel):
    points: list[Point]
    end: Point | None = None


def test_schema_contains_its_definitions() -> None:
    content = request_body(Line)["requestBody"]["content"]
    point = {
        "properties": {"x": {"title": "X", "type": "number"}},
        "required": ["x"],
        "title": "Point",
        "type": "object",
    }
    schema = content["application/json"]["schema"]
    assert schema["properties"]["points"]["items"] == point
    assert schema["properties"]["end"]["anyOf"] == [point, {"type": "null"}]
    assert "$" not in json.dumps(request_body(Staging))


def test_body_in_several_media_types() -> None:
    body = request_body(Point, "application/json", "application/msgpack")["requestBody"]
    assert body["required"]
    assert list(body["content"]) == ["application/json", "application/msgpack"]
