"""Signatures of functions and classes, from their syntax trees."""

import ast
import re
from collections.abc import Mapping

WIDTH = 88
"""Characters of a line of a signature."""


def is_public(name: str) -> bool:
    """Whether a name is for users."""
    return not name.startswith("_")


def decorators(node: ast.FunctionDef) -> list[str]:
    """Names of a function's decorators."""
    return [ast.unparse(entry) for entry in node.decorator_list]


def bases(node: ast.ClassDef, imports: Mapping[str, str]) -> list[str]:
    """Base classes without their type parameters, and with the modules of other packages that they come from."""
    names = [ast.unparse(base).partition("[")[0] for base in node.bases]
    return [f"{imports[name]}.{name}" if name in imports else name for name in names]


def expression(node: ast.expr) -> str:
    """Text of an expression."""
    text = ast.unparse(node)
    return text if '"' in text else text.replace("'", '"')


def kind_of(annotation: ast.expr) -> str:
    """Type as text, without the names of modules that every reader knows."""
    text = expression(annotation).strip('"')
    text = re.sub(r"\b(npt|np|typing)\.(?=[A-Z])|\bnp\.(?=(?:u?int|float|bool)\w*\b)", "", text)
    return re.sub(r"\bClassVar\[(.*)\]$", r"\1", text)


def _argument(name: str, entry: ast.arg, default: ast.expr | None) -> str:
    kind = f": {kind_of(entry.annotation)}" if entry.annotation else ""
    equals = " = " if kind else "="
    return f"{name}{entry.arg}{kind}" + (f"{equals}{expression(default)}" if default else "")


def _arguments(node: ast.FunctionDef, bound: bool) -> list[str]:
    """Arguments as they stand in a signature; without the first one if the function is bound."""
    given = node.args
    positional = [*given.posonlyargs, *given.args]
    defaults = [*[None] * (len(positional) - len(given.defaults)), *given.defaults]
    words = [_argument("", entry, default) for entry, default in zip(positional, defaults, strict=True)]
    if given.posonlyargs:
        words.insert(len(given.posonlyargs), "/")
    if bound:
        words = words[1:]
    if words[:1] == ["/"]:
        words = words[1:]
    if given.vararg:
        words.append(_argument("*", given.vararg, None))
    elif given.kwonlyargs:
        words.append("*")
    words += [_argument("", entry, value) for entry, value in zip(given.kwonlyargs, given.kw_defaults, strict=True)]
    return [*words, _argument("**", given.kwarg, None)] if given.kwarg else words


def signature(node: ast.FunctionDef, name: str, bound: bool = False) -> str:
    """Signature of a function under a name, in one line or with a line per argument."""
    words = _arguments(node, bound)
    made = node.name in ("__init__", "__new__")
    returns = f" -> {kind_of(node.returns)}" if node.returns and not made else ""
    line = f"{name}({', '.join(words)}){returns}"
    if len(line) <= WIDTH or not words:
        return line
    return "\n".join([f"{name}(", *(f"    {word}," for word in words), f"){returns}"])
