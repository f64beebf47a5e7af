"""Sections of classes and functions."""

import ast
from collections.abc import Mapping
from inspect import cleandoc

from generator.docstring import docstring, in_line, markdown, summary
from generator.markdown import anchor, block, code, table
from generator.signatures import WIDTH, bases, decorators, expression, is_public, kind_of, signature

Definition = ast.ClassDef | ast.FunctionDef
Row = tuple[str, str, str, str]


def section(nodes: list[Definition], level: str, imports: Mapping[str, str]) -> list[str]:
    """Section of a class, or of a function with its overloads."""
    if isinstance(nodes[0], ast.ClassDef):
        return _class(nodes[0], level, imports)
    functions = [node for node in nodes if isinstance(node, ast.FunctionDef)]
    return _function(functions[0].name, [signature(node, node.name) for node in functions], functions, level)


def _function(title: str, signatures: list[str], nodes: list[ast.FunctionDef], level: str) -> list[str]:
    text = next((text for node in nodes if (text := docstring(node))), "")
    # two underscores would be bold
    title = code(title) if "__" in title else title
    return [f"{level} {title}", "", *block("py", "\n".join(signatures)), *markdown(text)]


def _class(node: ast.ClassDef, level: str, imports: Mapping[str, str]) -> list[str]:
    """Section of a class: how it is made, its attributes, and its methods."""
    functions = [item for item in node.body if isinstance(item, ast.FunctionDef)]
    makers = [item for item in functions if item.name in ("__init__", "__new__")]
    methods: dict[str, list[ast.FunctionDef]] = {}
    for item in functions:
        if (is_public(item.name) or item.name == "__call__") and "property" not in decorators(item):
            methods.setdefault(item.name, []).append(item)
    lines = [f"{level} {node.name}", ""]
    parents = [code(name) for name in bases(node, imports)]
    lines += [f"Subclass of {', '.join(parents)}.", ""] if parents else []
    lines += markdown(docstring(node))
    for maker in makers:
        lines += [*block("py", signature(maker, node.name, bound=True)), *markdown(docstring(maker))]
    lines += table(["attribute", "type", "default", "meaning"], _attributes(node))
    return lines + _methods(node.name, methods, f"{level}#")


def _methods(owner: str, methods: dict[str, list[ast.FunctionDef]], level: str) -> list[str]:
    """Table of the methods, and a section for each one that has more to say than a line of the table."""
    rows, sections = [], list[str]()
    for name, nodes in methods.items():
        static = bool({"staticmethod", "classmethod"} & set(decorators(nodes[0])))
        called = owner.lower() if name == "__call__" else f"{owner}.{name}" if static else name
        signatures = [signature(node, called, bound="staticmethod" not in decorators(node)) for node in nodes]
        text = docstring(nodes[0])
        if len(nodes) == 1 and len(signatures[0]) <= WIDTH and "\n" not in signatures[0] and "\n\n" not in text:
            rows.append((code(signatures[0]), in_line(text)))
        else:
            title = f"{owner}.{name}"
            rows.append((f"[{code(f'{called}(...)')}](#{anchor(title)})", summary(text)))
            sections += _function(title, signatures, nodes, level)
    return table(["method", "meaning"], rows) + sections


def _attributes(node: ast.ClassDef) -> list[Row]:
    """Fields, properties, and what the constructor assigns; those without a description are left out."""
    rows = []
    for index, item in enumerate(node.body):
        if isinstance(item, ast.AnnAssign) and isinstance(item.target, ast.Name):
            default = expression(item.value) if item.value else ""
            text = _text_below(node.body, index)
            rows.append((item.target.id, kind_of(item.annotation), default, text))
        elif isinstance(item, ast.FunctionDef) and "property" in decorators(item):
            rows.append((item.name, kind_of(item.returns) if item.returns else "", "", docstring(item)))
        elif isinstance(item, ast.FunctionDef) and item.name == "__init__":
            rows += _assigned(item)
    shown = [row for row in rows if is_public(row[0]) and row[3]]
    return [(code(name), code(kind), code(default), in_line(text)) for name, kind, default, text in shown]


def _assigned(maker: ast.FunctionDef) -> list[Row]:
    """Attributes that a constructor assigns."""
    rows = []
    for index, item in enumerate(maker.body):
        text = _text_below(maker.body, index)
        if isinstance(item, ast.AnnAssign) and isinstance(item.target, ast.Attribute):
            rows.append((item.target.attr, kind_of(item.annotation), "", text))
        elif isinstance(item, ast.Assign) and isinstance(item.targets[0], ast.Attribute):
            rows.append((item.targets[0].attr, "", "", text))
    return rows


def _text_below(body: list[ast.stmt], index: int) -> str:
    """The string below an assignment, which describes it."""
    match body[index + 1 : index + 2]:
        case [ast.Expr(ast.Constant(str() as text))]:
            return cleandoc(text)
    return ""
