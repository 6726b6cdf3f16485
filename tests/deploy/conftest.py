"""Rendered manifests of deploy/kubernetes, rendered once in each test process."""

from __future__ import annotations

import pytest

from tests.deploy.manifests import OVERLAYS, RenderedOverlay, render_overlay


@pytest.fixture(scope="session")
def laptop(tmp_path_factory: pytest.TempPathFactory) -> RenderedOverlay:
    return RenderedOverlay(render_overlay(tmp_path_factory.mktemp("laptop"), "laptop"))


@pytest.fixture(scope="session")
def cluster(tmp_path_factory: pytest.TempPathFactory) -> RenderedOverlay:
    return RenderedOverlay(render_overlay(tmp_path_factory.mktemp("cluster"), "cluster"))


@pytest.fixture(scope="module", params=OVERLAYS)
def rendered(request: pytest.FixtureRequest) -> RenderedOverlay:
    overlay: RenderedOverlay = request.getfixturevalue(request.param)
    return overlay
