"""Manifests of deploy/kubernetes as a cluster receives them: rendered by the real `kubectl kustomize`."""

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
"""Oldest kustomize version that the README supports; part of kubectl since 1.27."""
Manifest = dict[str, Any]


def readme_commands(containing: str) -> str:
    """Return the only block of shell commands of deploy/kubernetes/README.md that contains a text."""
    text = (KUBERNETES / "README.md").read_text()
    found: list[str] = [block for block in re.findall(r"```sh\n(.*?)```", text, re.DOTALL) if containing in block]
    assert len(found) == 1, containing
    return found[0]


def find_kubectl() -> str:
    """Return the path of a recent kubectl; skip the test if there is none."""
    found = shutil.which("kubectl")
    if found is None:
        pytest.skip("kubectl is not installed")
    version_info = json.loads(subprocess.check_output([found, "version", "--client", "--output", "json"]))
    version = re.match(r"v(\d+)", version_info.get("kustomizeVersion", ""))
    if version is None or int(version[1]) < MIN_KUSTOMIZE_VERSION:
        pytest.skip(f"kubectl is too old: {version_info}")
    return found


def render_overlay(folder: Path, overlay: str) -> list[Manifest]:
    """Render an overlay in a copy in `folder`, with its settings files made by the commands of the README."""
    program = find_kubectl()
    ignored = shutil.ignore_patterns("secret.env", "*.crt", "*.key")
    shutil.copytree(KUBERNETES, folder / "kubernetes", ignore=ignored)
    script = readme_commands("> secret.env").replace(
        "deploy/kubernetes/overlays/laptop", f"kubernetes/overlays/{overlay}"
    )
    if overlay == "cluster":
        script += readme_commands("> settings.env")
    subprocess.run(["sh", "-euc", script], cwd=folder, check=True)
    rendered = subprocess.check_output([program, "kustomize", f"kubernetes/overlays/{overlay}"], cwd=folder)
    return list(yaml.safe_load_all(rendered))


class RenderedOverlay:
    """Manifests rendered from an overlay."""

    def __init__(self, manifests: list[Manifest]) -> None:
        self.manifests = manifests

    def of(self, *kinds: str) -> dict[str, Manifest]:
        """Return the objects of these kinds by name."""
        return {one["metadata"]["name"]: one for one in self.manifests if one["kind"] in kinds}

    def one(self, kind: str, prefix: str) -> Manifest:
        """Return the only object of a kind whose name has a prefix; generated names end in a hash."""
        (found,) = (one for name, one in self.of(kind).items() if name.startswith(prefix))
        return found

    def pods(self) -> dict[str, Manifest]:
        """Return the pod specification of each workload by name."""
        return {name: one["spec"]["template"]["spec"] for name, one in self.of("Deployment", "StatefulSet").items()}

    def containers(self) -> Iterator[tuple[str, Manifest]]:
        """Yield each workload's name with each of its containers."""
        for name, pod in self.pods().items():
            for container in (*pod["containers"], *pod.get("initContainers", ())):
                yield name, container

    def container(self, name: str) -> Manifest:
        """Return the only container of a workload."""
        (found,) = (container for workload, container in self.containers() if workload == name)
        return found

    def environment(self, name: str) -> dict[str, str]:
        """Return the variables of a workload in their order; a reference is given as `<name of its key>`."""
        container, variables = self.container(name), {}
        for source in container.get("envFrom", ()):
            variables.update(self.of("ConfigMap")[source["configMapRef"]["name"]]["data"])
        for one in container.get("env", ()):
            reference = one.get("valueFrom", {})
            key = reference.get("secretKeyRef") or reference.get("configMapKeyRef")
            variables[one["name"]] = one["value"] if "value" in one else f"<{key['key'] if key else one['name']}>"
        return variables
