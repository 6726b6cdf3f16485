"""The manifests of deploy/kubernetes as a cluster gets them: built by the real `kubectl kustomize`."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import yaml

from tests.conftest import REPOSITORY

KUBERNETES = REPOSITORY / "deploy" / "kubernetes"
OVERLAYS = ("laptop", "cluster")
MIN_KUSTOMIZE_VERSION = 5
"""The version of kustomize, of which kubectl has had one since 1.27, that the README asks for."""
Manifest = dict[str, Any]


def readme_commands(containing: str) -> str:
    """The block of commands of deploy/kubernetes/README.md that has this in it."""
    text = (KUBERNETES / "README.md").read_text()
    found: list[str] = [block for block in re.findall(r"```sh\n(.*?)```", text, re.DOTALL) if containing in block]
    assert len(found) == 1, containing
    return found[0]


def find_kubectl() -> str:
    """Where a kubectl is that is new enough; else the test is skipped."""
    found = shutil.which("kubectl")
    if found is None:
        pytest.skip("kubectl is not installed")
    said = json.loads(subprocess.check_output([found, "version", "--client", "--output", "json"]))
    version = re.match(r"v(\d+)", said.get("kustomizeVersion", ""))
    if version is None or int(version[1]) < MIN_KUSTOMIZE_VERSION:
        pytest.skip(f"kubectl is too old: {said}")
    return found


def render_overlay(folder: Path, overlay: str) -> list[Manifest]:
    """An overlay's manifests, with the files made by the README's own commands in a copy in `folder`."""
    program = find_kubectl()
    shutil.copytree(KUBERNETES, folder / "kubernetes", ignore=shutil.ignore_patterns("secret.env"))
    made = readme_commands("> secret.env").replace(
        "deploy/kubernetes/overlays/laptop", f"kubernetes/overlays/{overlay}"
    )
    if overlay == "cluster":
        made += readme_commands("> settings.env")
    subprocess.run(["sh", "-euc", made], cwd=folder, check=True)
    built = subprocess.check_output([program, "kustomize", f"kubernetes/overlays/{overlay}"], cwd=folder)
    return list(yaml.safe_load_all(built))


class RenderedOverlay:
    """What an overlay makes."""

    def __init__(self, manifests: list[Manifest]) -> None:
        self.manifests = manifests

    def of(self, *kinds: str) -> dict[str, Manifest]:
        """The objects of these kinds by name."""
        return {one["metadata"]["name"]: one for one in self.manifests if one["kind"] in kinds}

    def one(self, kind: str, begin: str) -> Manifest:
        """The one of a kind whose name begins so: generated ones end in a hash."""
        (found,) = (one for name, one in self.of(kind).items() if name.startswith(begin))
        return found

    def pods(self) -> dict[str, Manifest]:
        """The specification of each workload's pods, by the workload's name."""
        return {name: one["spec"]["template"]["spec"] for name, one in self.of("Deployment", "StatefulSet").items()}

    def containers(self) -> Iterator[tuple[str, Manifest]]:
        """Each workload with its containers."""
        for name, pod in self.pods().items():
            for container in (*pod["containers"], *pod.get("initContainers", ())):
                yield name, container

    def container(self, name: str) -> Manifest:
        """The only container of a workload."""
        (found,) = (container for workload, container in self.containers() if workload == name)
        return found

    def environment(self, name: str) -> dict[str, str]:
        """The variables of a workload, in their order; from elsewhere than the manifest as `<name of its key>`."""
        container, given = self.container(name), {}
        for source in container.get("envFrom", ()):
            given.update(self.of("ConfigMap")[source["configMapRef"]["name"]]["data"])
        for one in container.get("env", ()):
            reference = one.get("valueFrom", {})
            key = reference.get("secretKeyRef") or reference.get("configMapKeyRef")
            given[one["name"]] = one["value"] if "value" in one else f"<{key['key'] if key else one['name']}>"
        return given
