"""The arrows of the package: which file imports which, read from the source without running it."""

import ast

#: The parts, in the order in which data flows: a part imports only what stands before it, and itself.
PARTS = [
    "version",
    "errors",
    "_core",
    "show",
    "scene",
    "modes",
    "locus",
    "motion",
    "cycles",
    "transient",
    "energy",
    "study",
    "types",
    "files",
    "plot",
    "reference",
    "report",
    "cli",
]
#: Files in a folder.
MOST = 10


def modules(root):
    """Return the files of a package by their dotted name; the stub of the core is a file of its own."""
    found = {}
    for file in sorted([*root.rglob("*.py"), root / "_core.pyi"]):
        if file.exists():
            parts = file.relative_to(root.parent).with_suffix("").parts
            found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = file
    return found


def arrows(root):
    """Return (from, to) for every import anywhere in a file: at the top, in a function, for types only.

    The package itself is left out: it names what users see, and everything of it is loaded on demand. The
    command line, which uses these names, stands last and may.
    """
    names = modules(root)
    top = root.name
    found = set()
    for name, file in names.items():
        if name == top:
            continue
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            for target in _targets(node, name, file.name == "__init__.py"):
                while target and target not in names:
                    target = target.rpartition(".")[0]
                if target and target not in (name, top):
                    found.add((name, target))
    return found


def _targets(node, name, is_package):
    """Return what a node imports, each as long as it is written."""
    if isinstance(node, ast.Import):
        return [alias.name for alias in node.names]
    if not isinstance(node, ast.ImportFrom):
        return []
    base = node.module or ""
    if node.level:
        parents = name.split(".")[: len(name.split(".")) - node.level + is_package]
        base = ".".join([*parents, *([node.module] if node.module else [])])
    return [f"{base}.{alias.name}" for alias in node.names]


def part(module):
    """Return the place of a module's part in the order."""
    return PARTS.index(module.split(".")[1])


def upward(root):
    """Return the arrows from a part to a later one, as text."""
    return sorted(f"{a} -> {b}" for a, b in arrows(root) if part(a) < part(b))


def strangers(root):
    """Return the files that belong to no part."""
    return sorted(name for name in modules(root) if "." in name and name.split(".")[1] not in PARTS)


def circles(root):
    """Return the sets of files that reach one another, each sorted."""
    graph = {}
    for a, b in arrows(root):
        graph.setdefault(a, set()).add(b)

    def reached(start):
        seen, waiting = set(), [start]
        while waiting:
            for found in graph.get(waiting.pop(), ()):
                if found not in seen:
                    seen.add(found)
                    waiting.append(found)
        return seen

    reach = {name: reached(name) for name in graph}
    inside = [name for name in graph if name in reach[name]]
    return sorted({tuple(sorted(b for b in inside if b in reach[a] and a in reach[b])) for a in inside})


def crowded(root):
    """Return the folders of more than `MOST` modules."""
    folders = {}
    for file in root.rglob("*.py"):
        folders.setdefault(file.parent, []).append(file)
    return sorted(
        str(folder.relative_to(root.parent)) for folder, files in folders.items() if len(files) > MOST
    )
