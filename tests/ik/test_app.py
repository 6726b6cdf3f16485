from __future__ import annotations

import hashlib
import json
from typing import Any

import msgpack
import numpy as np
import pytest
from fastapi.testclient import TestClient

from bunraku.ik.app import create_app
from bunraku.marionette import arm_batch, bend_table, constants, figures
from bunraku.marionette.proportions import Proportions

IDENTITY = "396-352-252-560-320-120"
TABLE = f"/v1/arms/{IDENTITY}/table"
MSGPACK = "application/msgpack"


@pytest.fixture(scope="module")
def client() -> TestClient:
    return TestClient(create_app())


def test_the_table_is_immutable_and_known_by_its_content(client: TestClient) -> None:
    answer = client.get(TABLE)
    assert answer.status_code == 200
    assert answer.headers["content-type"] == "application/octet-stream"
    assert answer.headers["cache-control"] == "public, max-age=31536000, immutable"
    assert np.array_equal(
        bend_table.parse_bend_table(answer.content), bend_table.build_bend_table(Proportions.parse(IDENTITY))
    )
    etag = answer.headers["etag"]
    assert etag == f'"{hashlib.sha256(answer.content).hexdigest()[:32]}"'
    other = client.get("/v1/arms/400-400-200-560-320-120/table")
    assert other.headers["etag"] != etag


@pytest.mark.parametrize("wrapped", ["{}", "W/{}", '"other", {}', "*"])
def test_matching_etag_gives_304(client: TestClient, wrapped: str) -> None:
    etag = client.get(TABLE).headers["etag"]
    answer = client.get(TABLE, headers={"If-None-Match": wrapped.format(etag)})
    assert answer.status_code == 304
    assert answer.content == b""
    assert answer.headers["etag"] == etag
    assert client.get(TABLE, headers={"If-None-Match": '"other"'}).status_code == 200


@pytest.mark.parametrize("name", ["circle", "horizontal"])
def test_figures_are_immutable_pictures_of_this_arm(client: TestClient, name: str) -> None:
    answer = client.get(f"/v1/arms/{IDENTITY}/figures/{name}")
    assert answer.status_code == 200
    assert answer.headers["content-type"] == "image/svg+xml"
    assert answer.headers["cache-control"] == "public, max-age=31536000, immutable"
    assert answer.text == figures.draw_figure(
        Proportions.parse(IDENTITY), "circle" if name == "circle" else "horizontal"
    )
    etag = answer.headers["etag"]
    assert client.get(f"/v1/arms/{IDENTITY}/figures/{name}", headers={"If-None-Match": etag}).status_code == 304
    other = client.get(f"/v1/arms/400-400-200-560-320-120/figures/{name}")
    assert other.headers["etag"] != etag


def test_no_such_figure(client: TestClient) -> None:
    answer = client.get(f"/v1/arms/{IDENTITY}/figures/spiral")
    assert answer.status_code == 404
    assert answer.json()["hint"] == "circle or horizontal"
    assert client.get("/v1/arms/1-2-3/figures/circle").status_code == 422


@pytest.mark.parametrize(
    ("identity", "field"), [("1-2-3", "proportions"), ("396-352-253-560-320-120", "L0"), ("980-10-10-1-1-998", "L1")]
)
def test_no_such_arm(client: TestClient, identity: str, field: str) -> None:
    answer = client.get(f"/v1/arms/{identity}/table")
    assert answer.status_code == 422
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.json()["field"] == field
    assert answer.json()["hint"]


@pytest.mark.parametrize("said", ["application/json", MSGPACK])
@pytest.mark.parametrize("heard", ["application/json", MSGPACK])
def test_a_batch_in_either_form(client: TestClient, said: str, heard: str) -> None:
    asked: dict[str, Any] = {
        "proportions": IDENTITY,
        "targets": [[0.1, -0.5, 0.4], [-0.6, 0.2, 0.1]],
        "legs": [0.7, -0.2, 9.0],
    }
    body = json.dumps(asked).encode() if said == "application/json" else msgpack.packb(asked)
    answer = client.post("/v1/solve", content=body, headers={"Content-Type": said, "Accept": heard})
    assert answer.status_code == 200, answer.text
    assert answer.headers["content-type"] == heard
    got = answer.json() if heard == "application/json" else msgpack.unpackb(answer.content)
    proportions = Proportions.parse(IDENTITY)
    wanted = arm_batch.solve_arms(
        proportions, bend_table.build_bend_table(proportions), np.array(asked["targets"], dtype=np.float64)
    )
    for name in ("azimuth", "elbow", "wrist", "tip"):
        np.testing.assert_array_equal(got["arms"][name], getattr(wanted, name))
    for name, angle in zip(("t0", "t1", "t2"), wanted.angles(), strict=True):
        np.testing.assert_array_equal(got["arms"][name], angle)
    np.testing.assert_allclose(got["arms"]["tip"], asked["targets"], atol=1e-12)
    assert got["legs"] == {
        "hip": [0.7, -0.2, constants.MAX_THIGH_ANGLE_RAD],
        "knee": [0.7, 0.0, constants.MAX_THIGH_ANGLE_RAD],
    }


def test_the_answer_is_in_the_requests_form_unless_another_is_accepted(client: TestClient) -> None:
    body = msgpack.packb({"proportions": IDENTITY})
    answer = client.post("/v1/solve", content=body, headers={"Content-Type": "application/x-msgpack", "Accept": "*/*"})
    assert answer.headers["content-type"] == MSGPACK
    assert msgpack.unpackb(answer.content)["arms"]["tip"] == []


@pytest.mark.parametrize(
    ("change", "field"),
    [
        ({"targets": [[0, 0, 0], [0, 1]]}, "targets[1][2]"),
        ({"targets": [[0, 0, 0], [0, float("nan"), 0]]}, "targets[1][1]"),
        ({"legs": ["far"]}, "legs[0]"),
        ({"legs": [float("inf")]}, "legs[0]"),
        ({"proportions": 7}, "proportions"),
        ({"proportions": "396-352-252-560-320-121"}, "M0"),
        ({"targets": [[0, 0, 0]] * 100_001}, "targets"),
    ],
)
def test_a_bad_request_says_which_field(client: TestClient, change: dict[str, Any], field: str) -> None:
    body = msgpack.packb({"proportions": IDENTITY, **change})
    answer = client.post("/v1/solve", content=body, headers={"Content-Type": MSGPACK, "Accept": "application/json"})
    assert answer.status_code == 422
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.json()["field"] == field


@pytest.mark.parametrize(
    ("body", "headers", "status"),
    [
        (b"{", {"Content-Type": "application/json"}, 400),
        (b"\xff\xfe", {"Content-Type": "application/json"}, 400),
        (b"[" * 100_000, {"Content-Type": "application/json"}, 400),
        (b"\xc1", {"Content-Type": MSGPACK}, 400),
        (b"", {"Content-Type": MSGPACK}, 400),
        (b"x", {"Content-Type": "text/plain"}, 415),
        (b"{}", {"Content-Type": "application/json", "Accept": "image/png"}, 406),
        (b" " * (16 * 1024 * 1024 + 1), {"Content-Type": "application/json"}, 413),
        (b"[]", {"Content-Type": "application/json"}, 422),
    ],
)
def test_what_cannot_be_read_is_a_problem(
    client: TestClient, body: bytes, headers: dict[str, str], status: int
) -> None:
    answer = client.post("/v1/solve", content=body, headers=headers)
    assert answer.status_code == status
    assert answer.headers["content-type"] == "application/problem+json"
    assert answer.json()["status"] == status


def test_a_hundred_thousand_arms_fit_in_one_batch(client: TestClient) -> None:
    targets = np.random.default_rng(3).uniform(-0.5, 0.5, (100_000, 3)).tolist()
    body = msgpack.packb({"proportions": IDENTITY, "targets": targets})
    answer = client.post("/v1/solve", content=body, headers={"Content-Type": MSGPACK})
    assert answer.status_code == 200
    assert len(msgpack.unpackb(answer.content)["arms"]["tip"]) == 100_000


def test_the_service_documents_itself(client: TestClient) -> None:
    document = client.get("/openapi.json").json()
    assert set(document["paths"]) == {
        "/v1/arms/{proportions}/table",
        "/v1/arms/{proportions}/figures/{name}",
        "/v1/solve",
    }
    body = document["paths"]["/v1/solve"]["post"]["requestBody"]["content"]
    assert set(body) == {"application/json", MSGPACK}
