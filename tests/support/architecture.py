"""The arrows of the package: which file imports which, read from the source without running it."""

import ast

#: The parts, in the order in which data flows: a part imports only what stands before it, and itself.
PARTS = [
    "version",
    "faults",
    "_core",
    "show",
    "scene",
    "modes",
    "locus",
    "motion",
    "errors",
    "cycles",
    "transient",
    "energy",
    "study",
    "fe",
    "types",
    "files",
    "figures",
    "explorer",
    "report",
    "cli",
]
#: Files in a folder.
MOST = 10
#: Modules without an underscore that their packages call private.
PRIVATE = ("numpy.core", "pandas.core", "xarray.core", "zarr.core")
#: Functions that import a module by its name.
IMPORTERS = ("import_module", "__import__", "lazy.load", "lazy_loader.load")


def modules(root):
    """Return the files of a package by their dotted name; the stub of the core is a file of its own."""
    found = {}
    for file in sorted([*root.rglob("*.py"), root / "_core.pyi"]):
        # `python -m stickslip` is the command line.
        if file.exists() and file.name != "__main__.py":
            parts = file.relative_to(root.parent).with_suffix("").parts
            found[".".join(parts[:-1] if parts[-1] == "__init__" else parts)] = file
    return found


def _nodes(file):
    """Return the nodes of a file, and of the stub beside it where that is a list of lazy imports."""
    files = [file]
    if file.suffix == ".py" and "attach_stub" in file.read_text(encoding="utf-8"):
        files.append(file.with_suffix(".pyi"))
    for one in files:
        yield from ast.walk(ast.parse(one.read_text(encoding="utf-8")))


def arrows(root):
    """Return (from, to) for every import anywhere in a file: at the top, in a function, for types only.

    Calls of `import_module` and `__import__` count, and what a `lazy_loader` brings on demand. The package
    itself is left out: it names what users see, and everything of it is loaded on demand. The command line,
    which uses these names, stands last and may.
    """
    names = modules(root)
    top = root.name
    found = set()
    for name, file in names.items():
        if name == top:
            continue
        for node in _nodes(file):
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
    if _called(node) in IMPORTERS:
        return [_told(node) or ""]
    if _called(node) == "attach":
        # lazy_loader.attach(package, submodules, {submodule: names})
        return [
            f"{name}.{one.value}"
            for argument in [*node.args[1:], *(keyword.value for keyword in node.keywords)]
            for one in ast.walk(argument)
            if isinstance(one, ast.Constant) and isinstance(one.value, str)
        ]
    if not isinstance(node, ast.ImportFrom):
        return []
    base = node.module or ""
    if node.level:
        parents = name.split(".")[: len(name.split(".")) - node.level + is_package]
        base = ".".join([*parents, *([node.module] if node.module else [])])
    return [f"{base}.{alias.name}" for alias in node.names]


def _called(node):
    """Return the function that a node calls, without its module unless this is part of the name."""
    if not isinstance(node, ast.Call):
        return ""
    name = ast.unparse(node.func)
    last = name.rpartition(".")[2]
    return last if last != "load" else name


def _told(node):
    """Return the module that a call names, of an f-string its beginning; None where that is computed."""
    given = [*node.args, *(keyword.value for keyword in node.keywords if keyword.arg == "name")][:1]
    if given and isinstance(given[0], ast.JoinedStr):
        given = given[0].values[:1]
    known = given and isinstance(given[0], ast.Constant) and isinstance(given[0].value, str)
    return given[0].value if known else None


def unread(root):
    """Return the files that import what only a run of them tells."""
    return sorted(
        name
        for name, file in modules(root).items()
        if any(_called(node) in IMPORTERS and _told(node) is None for node in _nodes(file))
    )


def private(root):
    """Return what files use of the private modules of other packages, as (file, module) in order.

    Private are names that begin with an underscore and `PRIVATE`, whether imported or reached by attributes.
    """
    found = set()
    for name, file in modules(root).items():
        aliases = {}
        nodes = list(_nodes(file))
        used = [target for node in nodes for target in _targets(node, name, file.name == "__init__.py")]
        for node in nodes:
            if isinstance(node, ast.Import):
                for alias in node.names:
                    aliases[alias.asname or alias.name.split(".")[0]] = (
                        alias.name if alias.asname else alias.name.split(".")[0]
                    )
        for node in nodes:
            if isinstance(node, ast.Attribute):
                first, _, rest = ast.unparse(node).partition(".")
                if first in aliases:
                    used.append(f"{aliases[first]}.{rest}")
        for target in used:
            parts = target.split(".")
            hidden = any(one.startswith("_") and not one.startswith("__") for one in parts)
            if parts[0] != root.name and (hidden or ".".join(parts[:2]) in PRIVATE):
                found.add((name, target))
    return sorted(found)


def part(module):
    """Return the place of a module's part in the order."""
    return PARTS.index(module.split(".")[1])


def upward(root):
    """Return the arrows from a part to a later one, as text."""
    return sorted(f"{a} -> {b}" for a, b in arrows(root) if part(a) < part(b))


def drawing(root):
    """Return the parts and the fewest arrows (used, user) between them that every import follows."""
    used = {name: set() for name in PARTS}
    for user, other in arrows(root):
        used[user.split(".")[1]].add(other.split(".")[1])

    def reached(part, below):
        return any(one == below or reached(one, below) for one in used[part] - {part})

    return set(PARTS), {
        (below, part)
        for part in PARTS
        for below in used[part] - {part}
        if not any(reached(one, below) for one in used[part] - {part, below})
    }


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
