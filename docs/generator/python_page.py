"""The reference of the Python package, from the types and docstrings of its sources."""

import ast
from collections.abc import Mapping
from pathlib import Path

from generator.classes import Definition, section
from generator.docstring import docstring, markdown, summary
from generator.markdown import Anchors, code, table
from generator.signatures import is_public

GROUPS = {
    "Environments": ("VecEnv", "MarathonEnv", "MarathonVectorEnv", "Spec", "CommandRange", "ids", "spec"),
    "Training and policies": ("train", "TrainResult", "Policy", "load_policy", "evaluate"),
    "Your own agents": ("MarathonAgent", "ResetNoise", "Streams", "Tolerance"),
    "Physics": ("Model", "Simulation"),
    "Clips and images": ("Clip", "Renderer", "Viewer"),
}
"""Names of the package by their purpose; others follow under "Other names"."""
ARGUMENTS = {"Streams": "_arrays"}
"""Classes that functions of the user receive, with the private modules that define them."""
ADAPTERS = ("sb3", "pettingzoo", "rsl_rl", "skrl", "dm_env")
MODULES = ("memory", "ray", "compare_gymnasium", *(f"adapters.{name}" for name in ADAPTERS))
"""Public modules beside the package itself."""
INTRODUCTION = """\
# Python API

<!-- Written by docs/generate.py from the sources of the package; do not edit. -->

This page lists the public names of the package `marathon_rl`. [Its modules](python-modules.md) connect it to
other libraries.
[Train from Python](../tutorials/python.md) is an introduction. `help(marathon_rl.VecEnv)` prints the same text.

`NDArray` and `ArrayLike` are types of `numpy.typing`. `FloatArray` and `BoolArray` are NumPy arrays of numbers and of
truth values. `Task` is the name of a task, or a subclass of `MarathonAgent`. `N` is the number of agents.
"""

MODULES_INTRODUCTION = """\
# Python API: modules

<!-- Written by docs/generate.py from the sources of the package; do not edit. -->

These modules of the package connect [its names](python.md) to other libraries, and compare them with
Gymnasium. Import each by its full name.
"""


class Module:
    """Public definitions of a source file."""

    def __init__(self, path: Path) -> None:
        """Read the file."""
        tree = ast.parse(path.read_text("utf-8"))
        self.doc = docstring(tree)
        self.names: dict[str, list[Definition]] = {}
        self.imports: dict[str, str] = {}
        """Modules of other packages that names come from."""
        for node in tree.body:
            if isinstance(node, Definition) and is_public(node.name):
                self.names.setdefault(node.name, []).append(node)
            elif isinstance(node, ast.ImportFrom) and node.module and not node.module.startswith("marathon_rl"):
                self.imports.update({alias.asname or alias.name: node.module for alias in node.names})

    def section(self, name: str) -> list[str]:
        """Section of a class or function."""
        return section(self.names[name], "###", self.imports)


def exported(package: Path) -> Mapping[str, Module]:
    """Names that the package exports, with the modules that define them."""
    tree = ast.parse((package / "__init__.py").read_text("utf-8"))
    sources: dict[str, str] = {}
    names: list[str] = []
    for node in tree.body:
        if isinstance(node, ast.ImportFrom) and node.module:
            sources.update({alias.asname or alias.name: node.module for alias in node.names})
        elif isinstance(node, ast.Assign) and ast.unparse(node.targets[0]) == "__all__":
            names = ast.literal_eval(node.value)
    found: dict[str, Module] = {}
    for name in names:
        file = package.parent / sources[name].replace(".", "/")
        module = Module(next(path for path in (file.with_suffix(".pyi"), file.with_suffix(".py")) if path.exists()))
        # a variable, such as the version, has no section
        if name in module.names:
            found[name] = module
    return found | {name: Module(package / f"{file}.py") for name, file in ARGUMENTS.items()}


def page(package: Path) -> str:
    """Text of the page of the package itself."""
    names = exported(package)
    grouped = {name for group in GROUPS.values() for name in group}
    groups = {**GROUPS, "Other names": tuple(name for name in names if name not in grouped)}
    lines, body, anchors = [INTRODUCTION], list[str](), Anchors("Python API")
    for title, group in groups.items():
        members = [name for name in group if name in names]
        if not members:
            continue
        body += [f"## {title}", ""]
        anchors.add(title)
        rows = []
        for name in members:
            text = names[name].section(name)
            rows.append((f"[{code(name)}](#{_first_anchor(anchors, text)})", summary(_doc(names[name].names[name]))))
            body += text
        lines += [f"**{title}**", "", *table(["name", "purpose"], rows)]
    return "\n".join([*lines, *body]).rstrip() + "\n"


def modules_page(package: Path) -> str:
    """Text of the page of the other public modules."""
    body, rows, anchors = list[str](), [], Anchors("Python API: modules")
    for name in MODULES:
        module, full = Module(package / f"{name.replace('.', '/')}.py"), f"marathon_rl.{name}"
        text = [f"## {full}", "", *markdown(module.doc)]
        text += [line for member in module.names for line in module.section(member)]
        rows.append((f"[{code(full)}](#{_first_anchor(anchors, text)})", summary(module.doc)))
        body += text
    return "\n".join([MODULES_INTRODUCTION, *table(["module", "purpose"], rows), *body]).rstrip() + "\n"


def _first_anchor(anchors: Anchors, text: list[str]) -> str:
    """Take in the headings of a section and return the anchor of its own."""
    first, *_ = [anchors.add(line.lstrip("# ")) for line in text if line.startswith("#")]
    return first


def _doc(nodes: list[Definition]) -> str:
    """Docstring of a definition; of overloads, the first one that there is."""
    return next((text for node in nodes if (text := docstring(node))), "")
