"""What docs/architecture.md claims of the source: no import circles, within functions neither, and one name for one thing."""

import ast
from collections import defaultdict
from pathlib import Path

import pytest

import ancf_petsc

PACKAGE = Path(ancf_petsc.__file__).parent


def modules():
    """Dotted name -> syntax tree of every module."""
    trees = {}
    for file in sorted(PACKAGE.rglob("*.py")):
        parts = (PACKAGE.name, *file.relative_to(PACKAGE).with_suffix("").parts)
        trees[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = ast.parse(
            file.read_text(encoding="utf-8")
        )
    return trees


def imported(name, tree, known):
    """Modules that one imports wherever it does: at the top, in functions, for types alone; with their packages."""
    found = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom):
            assert not node.level, f"{name}: relative imports are not looked at"
            found |= {node.module, *(f"{node.module}.{alias.name}" for alias in node.names)}
        elif isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
    within = {".".join(item.split(".")[:k]) for item in found for k in range(1, item.count(".") + 2)}
    above = {".".join(name.split(".")[:k]) for k in range(1, name.count(".") + 2)}
    return {item for item in within & known if item not in above}


def circles(graph):
    """Sets of modules each of which is reached from every other."""
    reached = {}
    for start in graph:
        seen, waiting = set(), [start]
        while waiting:
            for item in graph[waiting.pop()] - seen:
                seen.add(item)
                waiting.append(item)
        reached[start] = seen
    return {frozenset(b for b in reached[a] if a in reached[b]) for a in graph if a in reached[a]}


def test_no_imports_go_round_in_circles():
    trees = modules()
    graph = {name: imported(name, tree, trees.keys()) for name, tree in trees.items()}
    assert len(graph) > 150
    assert sum(map(len, graph.values())) > 500
    assert not circles(graph)


def test_folders_as_a_whole_go_round_in_no_circles_either():
    """Among what lies in one folder, its folders each taken as one."""
    trees = modules()
    inside = defaultdict(lambda: defaultdict(set))
    for name, tree in trees.items():
        for other in imported(name, tree, trees.keys()):
            ours, theirs = name.split("."), other.split(".")
            shared = next(k for k in range(len(ours) + 1) if ours[: k + 1] != theirs[: k + 1])
            if shared < min(len(ours), len(theirs)):
                graph = inside[".".join(ours[:shared])]
                graph[ours[shared]].add(theirs[shared])
                graph[theirs[shared]] |= set()
    assert len(inside) > 10
    assert not {folder: found for folder, graph in inside.items() if (found := circles(graph))}


@pytest.mark.parametrize(
    ("graph", "expected"),
    [
        ({"a": {"b"}, "b": {"c"}, "c": set()}, set()),
        ({"a": {"b"}, "b": {"c"}, "c": {"a"}, "d": {"a"}}, {frozenset("abc")}),
    ],
)
def test_circles_are_found(graph, expected):
    assert circles(graph) == expected


def test_a_class_name_means_one_thing():
    places = defaultdict(list)
    for name, tree in modules().items():
        for node in tree.body:
            if isinstance(node, ast.ClassDef):
                places[node.name].append(name)
    assert len(places) > 100
    assert not {name: found for name, found in places.items() if len(found) > 1}
