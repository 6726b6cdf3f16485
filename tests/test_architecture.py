"""Architecture: no cycle between modules, and packages of one subject. import-linter checks the direction of layers."""

from __future__ import annotations

from collections import Counter

import grimp
import pytest

MAX_MODULES = 25
"""Modules of one package, without its subpackages."""


@pytest.fixture(scope="module")
def graph() -> grimp.ImportGraph:
    return grimp.build_graph("bunraku", exclude_type_checking_imports=False)


def find_cycle(graph: grimp.ImportGraph) -> list[str]:
    """Return the modules of one import cycle, or an empty list (depth-first search)."""
    finished: set[str] = set()
    for start in sorted(graph.modules):
        path: list[str] = []
        on_path: set[str] = set()
        stack: list[tuple[str, list[str]]] = [(start, sorted(graph.find_modules_directly_imported_by(start)))]
        if start in finished:
            continue
        path.append(start)
        on_path.add(start)
        while stack:
            module, imported = stack[-1]
            if not imported:
                stack.pop()
                finished.add(module)
                on_path.remove(path.pop())
                continue
            following = imported.pop()
            if following in on_path:
                return path[path.index(following) :]
            if following not in finished:
                path.append(following)
                on_path.add(following)
                stack.append((following, sorted(graph.find_modules_directly_imported_by(following))))
    return []


def test_modules_import_each_other_without_cycles(graph: grimp.ImportGraph) -> None:
    assert find_cycle(graph) == []


def test_a_cycle_is_found() -> None:
    graph = grimp.ImportGraph()
    for name in ("one", "two", "three", "four"):
        graph.add_module(name)
    for importer, imported in (("one", "two"), ("two", "three"), ("three", "two"), ("four", "one")):
        graph.add_import(importer=importer, imported=imported)
    assert sorted(find_cycle(graph)) == ["three", "two"]


def test_packages_have_one_subject(graph: grimp.ImportGraph) -> None:
    packages = Counter(module.rpartition(".")[0] for module in graph.modules if not graph.find_children(module))
    assert {package: count for package, count in packages.items() if count > MAX_MODULES} == {}
