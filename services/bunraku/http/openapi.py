"""Request bodies in the API description of routes that parse their body themselves."""

from __future__ import annotations

from typing import Any

from pydantic import BaseModel

JSON = "application/json"


def request_body(model: type[BaseModel], *media_types: str) -> dict[str, Any]:
    """Return the `openapi_extra` of a route with this request body, by default in JSON."""
    schema = model.model_json_schema()
    schema = _inline_references(schema, schema.pop("$defs", {}))
    content = {media_type: {"schema": schema} for media_type in media_types or (JSON,)}
    return {"requestBody": {"required": True, "content": content}}


def _inline_references(part: Any, definitions: dict[str, Any]) -> Any:
    """Return a part of a JSON schema with its definitions, which are not recursive, in place of references to them."""
    if isinstance(part, list):
        return [_inline_references(each, definitions) for each in part]
    if not isinstance(part, dict):
        return part
    if "$ref" in part:
        return _inline_references(definitions[part["$ref"].rpartition("/")[2]], definitions)
    return {key: _inline_references(value, definitions) for key, value in part.items()}
