"""Who imports whom in the package: by statements, wherever they stand, and by `import_module`.

A module has its full name; a package is its __init__. `import_module(f"clpt.formats.{kind}")`
imports whatever is there.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path

from bench.python_files import full_name, read

ROOT = Path(__file__).resolve().parents[1]
Graph = dict[str, set[str]]


def imports(path: Path, root: Path = ROOT) -> dict[str, int]:
    """Return the full names of imports of a file, and of their attributes, with lines."""
    return {
        name: statement.line
        for statement in read(path, root).imports
        for name in (statement.module, *(f"{statement.module}.{part}" for part in statement.names))
    }


def modules(root: Path = ROOT) -> dict[str, Path]:
    """The modules of the package by their full names."""
    paths = sorted((root / "clpt").rglob("*.py"))
    return {full_name(path, root).removesuffix(".__init__"): path for path in paths}


def graph(root: Path = ROOT, by_name: bool = True) -> Graph:
    """The modules that each module of the package imports; by_name: by `import_module` too."""
    known = modules(root)
    links: Graph = {}
    for name, path in known.items():
        file = read(path, root)
        taken = [
            (statement.module, part)
            for statement in file.imports
            for part in statement.names or [""]
        ]
        targets = {f"{m}.{part}" if f"{m}.{part}" in known else m for m, part in taken}
        for pattern in file.loaded if by_name else ():
            targets |= {other for other in known if re.fullmatch(pattern, other)}
        links[name] = targets & known.keys()
    return links


def rooms(root: Path = ROOT) -> dict[str, Graph]:
    """For each package, its rooms, and who of them imports whom.

    The rooms of a package are its folders and its modules. All that is in a folder, at whatever
    depth, imports and is imported as that folder. The front page of clpt is no room: it hands out
    what others have.
    """
    known, links = modules(root), graph(root)
    links["clpt"] = set()
    inside = {n: n if p.name != "__init__.py" else f"{n}.__init__" for n, p in known.items()}
    houses: dict[str, Graph] = {}
    for house in (name for name in known if inside[name] != name):
        depth = house.count(".") + 2
        room = {
            name: ".".join(full.split(".")[:depth])
            for name, full in inside.items()
            if full.startswith(f"{house}.")
        }
        houses[house] = {module_room: set() for module_room in room.values()}
        for name, module_room in room.items():
            houses[house][module_room] |= {
                room[other] for other in links[name] if other in room
            } - {module_room}
    return houses


def circle(links: Mapping[str, set[str]]) -> list[str]:
    """A circle of a graph, its first node again at the end; empty if there is none."""
    done: set[str] = set()
    for start in links:
        path: list[str] = []
        open_ = [iter([start])]
        while open_:
            if (node := next(open_[-1], None)) is None:
                open_.pop()
                done |= set(path[-1:])
                del path[-1:]
            elif node in path:
                return [*path[path.index(node) :], node]
            elif node not in done:
                path.append(node)
                open_.append(iter(sorted(links[node])))
    return []


def circles(links: Mapping[str, set[str]]) -> list[list[str]]:
    """The sets of two nodes or more that all reach each other, each as large as can be."""
    reached = {node: _reached(links, node) for node in links}
    groups: list[list[str]] = []
    for node in links:
        group = sorted({other for other in reached[node] if node in reached[other]} | {node})
        if len(group) > 1 and group not in groups:
            groups.append(group)
    return groups


def _reached(links: Mapping[str, set[str]], start: str) -> set[str]:
    """Return the nodes that links reach from `start`."""
    seen: set[str] = set()
    open_ = [*links[start]]
    while open_:
        if (node := open_.pop()) not in seen:
            seen.add(node)
            open_ += links[node]
    return seen
