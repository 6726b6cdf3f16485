from __future__ import annotations

import hashlib
import json
from typing import Any

import msgpack
import numpy as np
import pytest
from fastapi.testclient import TestClient

from bunraku.ik import batch
from bunraku.ik.app import create_app
from bunraku.marionette import arm_batch, bend_table, constants, figures
from bunraku.marionette.proportions import Proportions

IDENTITY = "396-352-252-560-320-120"
TABLE = f"/v1/arms/{IDENTITY}/table"
MSGPACK = "application/msgpack"


@pytest.fixture(scope="module")
def client() -> TestClient:
    return TestClient(create_app())


def test_table_is_immutable_and_its_etag_is_a_digest(client: TestClient) -> None:
    response = client.get(TABLE)
    assert response.status_code == 200
    assert response.headers["content-type"] == "application/octet-stream"
    assert response.headers["cache-control"] == "public, max-age=31536000, immutable"
    assert np.array_equal(
        bend_table.parse_bend_table(response.content), bend_table.build_bend_table(Proportions.parse(IDENTITY))
    )
    etag = response.headers["etag"]
    assert etag == f'"{hashlib.sha256(response.content).hexdigest()[:32]}"'
    other = client.get("/v1/arms/400-400-200-560-320-120/table")
    assert other.headers["etag"] != etag


@pytest.mark.parametrize("wrapped", ["{}", "W/{}", '"other", {}', "*"])
def test_matching_etag_gives_304(client: TestClient, wrapped: str) -> None:
    etag = client.get(TABLE).headers["etag"]
    response = client.get(TABLE, headers={"If-None-Match": wrapped.format(etag)})
    assert response.status_code == 304
    assert response.content == b""
    assert response.headers["etag"] == etag
    assert client.get(TABLE, headers={"If-None-Match": '"other"'}).status_code == 200


@pytest.mark.parametrize("name", ["circle", "horizontal"])
def test_figure_is_an_immutable_svg_of_the_arm(client: TestClient, name: str) -> None:
    response = client.get(f"/v1/arms/{IDENTITY}/figures/{name}")
    assert response.status_code == 200
    assert response.headers["content-type"] == "image/svg+xml"
    assert response.headers["cache-control"] == "public, max-age=31536000, immutable"
    assert response.text == figures.draw_figure(
        Proportions.parse(IDENTITY), "circle" if name == "circle" else "horizontal"
    )
    etag = response.headers["etag"]
    assert client.get(f"/v1/arms/{IDENTITY}/figures/{name}", headers={"If-None-Match": etag}).status_code == 304
    other = client.get(f"/v1/arms/400-400-200-560-320-120/figures/{name}")
    assert other.headers["etag"] != etag


def test_unknown_figure_gives_404(client: TestClient) -> None:
    response = client.get(f"/v1/arms/{IDENTITY}/figures/spiral")
    assert response.status_code == 404
    assert response.json()["hint"] == "circle or horizontal"
    assert client.get("/v1/arms/1-2-3/figures/circle").status_code == 422


@pytest.mark.parametrize(
    ("identity", "field"), [("1-2-3", "proportions"), ("396-352-253-560-320-120", "L0"), ("980-10-10-1-1-998", "L1")]
)
def test_invalid_identity_gives_422_and_names_the_field(client: TestClient, identity: str, field: str) -> None:
    response = client.get(f"/v1/arms/{identity}/table")
    assert response.status_code == 422
    assert response.headers["content-type"] == "application/problem+json"
    assert response.json()["field"] == field
    assert response.json()["hint"]


@pytest.mark.parametrize("content_type", ["application/json", MSGPACK])
@pytest.mark.parametrize("accept", ["application/json", MSGPACK])
def test_batch_in_each_media_type(client: TestClient, content_type: str, accept: str) -> None:
    request: dict[str, Any] = {
        "proportions": IDENTITY,
        "targets": [[0.1, -0.5, 0.4], [-0.6, 0.2, 0.1]],
        "legs": [0.7, -0.2, 9.0],
    }
    body = json.dumps(request).encode() if content_type == "application/json" else msgpack.packb(request)
    response = client.post("/v1/solve", content=body, headers={"Content-Type": content_type, "Accept": accept})
    assert response.status_code == 200, response.text
    assert response.headers["content-type"] == accept
    solution = response.json() if accept == "application/json" else msgpack.unpackb(response.content)
    proportions = Proportions.parse(IDENTITY)
    expected = arm_batch.solve_arms(
        proportions, bend_table.build_bend_table(proportions), np.array(request["targets"], dtype=np.float64)
    )
    for name in ("azimuth", "elbow", "wrist", "tip"):
        np.testing.assert_array_equal(solution["arms"][name], getattr(expected, name))
    for name, angle in zip(("t0", "t1", "t2"), expected.angles(), strict=True):
        np.testing.assert_array_equal(solution["arms"][name], angle)
    np.testing.assert_allclose(solution["arms"]["tip"], request["targets"], atol=1e-12)
    assert solution["legs"] == {
        "hip": [0.7, -0.2, constants.MAX_THIGH_ANGLE_RAD],
        "knee": [0.7, 0.0, constants.MAX_THIGH_ANGLE_RAD],
    }


def test_response_has_the_media_type_of_the_request_by_default(client: TestClient) -> None:
    body = msgpack.packb({"proportions": IDENTITY})
    response = client.post(
        "/v1/solve", content=body, headers={"Content-Type": "application/x-msgpack", "Accept": "*/*"}
    )
    assert response.headers["content-type"] == MSGPACK
    assert msgpack.unpackb(response.content)["arms"]["tip"] == []


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"targets": [[0, 0, 0], [0, 1]]}, "targets[1][2]"),
        ({"targets": [[0, 0, 0], [0, float("nan"), 0]]}, "targets[1][1]"),
        ({"legs": ["far"]}, "legs[0]"),
        ({"legs": [float("inf")]}, "legs[0]"),
        ({"proportions": 7}, "proportions"),
        ({"proportions": "396-352-252-560-320-121"}, "M0"),
        ({"targets": [[0, 0, 0]] * 10_001}, "targets"),
    ],
)
def test_invalid_request_names_the_field(client: TestClient, change: dict[str, Any], field: str) -> None:
    body = msgpack.packb({"proportions": IDENTITY, **change})
    response = client.post("/v1/solve", content=body, headers={"Content-Type": MSGPACK, "Accept": "application/json"})
    assert response.status_code == 422
    assert response.headers["content-type"] == "application/problem+json"
    assert response.json()["field"] == field


@pytest.mark.parametrize(
    ("body", "headers", "status"),
    [
        (b"{", {"Content-Type": "application/json"}, 400),
        (b"\xff\xfe", {"Content-Type": "application/json"}, 400),
        (b"[" * 50_000, {"Content-Type": "application/json"}, 400),
        (b"\xc1", {"Content-Type": MSGPACK}, 400),
        (b"", {"Content-Type": MSGPACK}, 400),
        (b"x", {"Content-Type": "text/plain"}, 415),
        (b"{}", {"Content-Type": "application/json", "Accept": "image/png"}, 406),
        (b"[" + b"{}," * 100_000 + b"{}]", {"Content-Type": "application/json"}, 413),
        (b"\xdd\x00\x01\xff\xff" + b"\x90" * 0x1FFFF, {"Content-Type": MSGPACK}, 413),
        (b"\xdd\xff\xff\xff\xff" * 10, {"Content-Type": MSGPACK}, 413),
        (b"[]", {"Content-Type": "application/json"}, 422),
    ],
)
def test_unreadable_request_gives_a_problem_document(
    client: TestClient, body: bytes, headers: dict[str, str], status: int
) -> None:
    response = client.post("/v1/solve", content=body, headers=headers)
    assert response.status_code == status
    assert response.headers["content-type"] == "application/problem+json"
    assert response.json()["status"] == status


def test_largest_batch_is_solved(client: TestClient) -> None:
    targets = np.random.default_rng(3).uniform(-0.5, 0.5, (batch.MAX_TARGETS, 3))
    body = msgpack.packb({"proportions": IDENTITY, "targets": targets.tolist()})
    response = client.post("/v1/solve", content=body, headers={"Content-Type": MSGPACK})
    assert response.status_code == 200
    proportions = Proportions.parse(IDENTITY)
    expected = arm_batch.solve_arms(proportions, bend_table.build_bend_table(proportions), targets)
    np.testing.assert_array_equal(msgpack.unpackb(response.content)["arms"]["tip"], expected.tip)


def test_openapi_document_lists_the_paths() -> None:
    document = create_app().openapi()
    assert set(document["paths"]) == {
        "/v1/arms/{proportions}/table",
        "/v1/arms/{proportions}/figures/{name}",
        "/v1/solve",
    }
    body = document["paths"]["/v1/solve"]["post"]["requestBody"]["content"]
    assert set(body) == {"application/json", MSGPACK}
