"""The reference: a page for each room, made from the docstrings of its public face when the documentation is built.

Sources are read, not imported, so nothing is compiled. What is public is what a room's `__init__.pyi` lists.
"""

import ast
import inspect
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parent.parent
FOLDER = ROOT / "docs" / "api"
ROOMS = {
    "primitives": "The shared model: robots, elements, distances, constraints, point clouds.",
    "vfi": "Enforce by inequality: the controller, its tasks, its messages and its solvers.",
    "admittance": "Enforce by a passive target admittance, or generate a reference with it.",
    "scenarios": "What can be run: scenes, trajectories and traces.",
}
_SECTIONS = ("Parameters", "Attributes", "Returns", "Raises")
_CODE = re.compile(r"(``?[^`]+``?)")
_MARKUP = re.compile(r"([\\*_\[\]<>|$#~{}])")

Definition = ast.ClassDef | ast.FunctionDef | ast.Assign | ast.AnnAssign


def names(room: str) -> list[str]:
    """What a room's face lists, in the order of `__all__`."""
    face = ast.parse((ROOT / room / "__init__.pyi").read_text(encoding="utf-8"))
    (listed,) = (n.value for n in face.body if isinstance(n, ast.Assign))
    return list(ast.literal_eval(listed))


def _origins(room: str) -> dict[str, str]:
    """{name: module that it is taken from}, "" for the room itself."""
    face = ast.parse((ROOT / room / "__init__.pyi").read_text(encoding="utf-8"))
    return {a.name: n.module or "" for n in face.body if isinstance(n, ast.ImportFrom) for a in n.names}


def _file(module: str) -> Path:
    path = ROOT.joinpath(*module.split("."))
    return path / "__init__.py" if path.is_dir() else path.with_suffix(".py")


def definition(module: str, name: str) -> tuple[Definition, str]:
    """Where a name is defined, following re-exports, and the docstring that stands in or below it."""
    body = ast.parse(_file(module).read_text(encoding="utf-8")).body
    for i, node in enumerate(body):
        if isinstance(node, ast.ClassDef | ast.FunctionDef) and node.name == name:
            return node, ast.get_docstring(node) or ""
        targets = (
            node.targets if isinstance(node, ast.Assign) else [node.target] if isinstance(node, ast.AnnAssign) else []
        )
        if any(isinstance(t, ast.Name) and t.id == name for t in targets):
            return node, _text_below(body, i)  # type: ignore[return-value]
        if isinstance(node, ast.ImportFrom) and any(name in (a.asname, a.name) for a in node.names):
            original = next(a.name for a in node.names if name in (a.asname, a.name))
            return definition(node.module or "", original)
    raise LookupError(f"{module} does not define {name}")


def _text_below(body: list[ast.stmt], i: int) -> str:
    after = body[i + 1] if i + 1 < len(body) else None
    if isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant) and isinstance(after.value.value, str):
        return inspect.cleandoc(after.value.value)
    return ""


def plain(text: str) -> str:
    """Text of a docstring as Markdown: code stays code, everything else stands for itself."""
    parts = _CODE.split(text)
    return "".join(f"`{p.strip('`')}`" if i % 2 else _MARKUP.sub(r"\\\1", p) for i, p in enumerate(parts))


def _entries(lines: list[str]) -> Iterator[str]:
    """Items of a section: what stands before " : " is a name."""
    for entry in re.split(r"\n(?=\S)", inspect.cleandoc("\n".join(lines))):
        for piece in _pieces(" ".join(entry.split())):
            head, colon, rest = piece.partition(" : ")
            yield f"- **{plain(head)}**: {plain(rest)}" if colon else f"- {plain(piece)}"


def _pieces(entry: str) -> list[str]:
    """Several short items may share a line, "t : seconds. state : RUN, ..."."""
    return re.split(r"(?<=\.) (?=[a-z_0-9]+ : )", entry)


def markdown(docstring: str) -> str:
    """A docstring as Markdown: paragraphs, set-off formulas, and the sections as lists."""
    out: list[str] = []
    blocks = re.split(r"\n\s*\n", docstring)
    for block in blocks:
        lines = block.splitlines()
        if len(lines) > 1 and lines[0] in _SECTIONS and set(lines[1]) == {"-"}:
            out.append(f"**{lines[0]}**\n\n" + "\n".join(_entries(lines[2:])))
        elif lines and all(line.startswith("  ") for line in lines):
            out.append("```text\n" + inspect.cleandoc(block) + "\n```")
        elif lines:
            out.append(plain(" ".join(line.strip() for line in lines)))
    return "\n\n".join(out)


def signature(node: ast.FunctionDef, drop_first: bool) -> str:
    """Names and defaults, without types: shapes and units stand in the text."""
    arguments = node.args
    for a in (*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs):
        a.annotation = None
    for extra in (arguments.vararg, arguments.kwarg):
        if extra is not None:
            extra.annotation = None
    if drop_first:
        arguments.args = arguments.args[1:]
    return f"({ast.unparse(arguments)})"


def _fields(node: ast.ClassDef, module: str) -> list[ast.AnnAssign]:
    """Fields of a class, those of its bases in the same module before its own."""
    body = ast.parse(_file(module).read_text(encoding="utf-8")).body
    bases = {ast.unparse(b) for b in node.bases}
    above = [f for n in body if isinstance(n, ast.ClassDef) and n.name in bases for f in _fields(n, module)]
    own = [n for n in node.body if isinstance(n, ast.AnnAssign) and "ClassVar" not in ast.unparse(n.annotation)]
    return above + own


def _constructor(node: ast.ClassDef, module: str) -> str:
    for inner in node.body:
        if isinstance(inner, ast.FunctionDef) and inner.name == "__init__":
            return signature(inner, drop_first=True)
    bases = {ast.unparse(b) for b in node.bases}
    if not any("dataclass" in ast.unparse(d) for d in node.decorator_list) and "NamedTuple" not in bases:
        return ""
    shown = []
    for field in _fields(node, module):
        value = ast.unparse(field.value) if field.value is not None else ""
        if "init=False" not in value:
            shown.append(ast.unparse(field.target) + (f"={value}" if value else ""))
    return f"({', '.join(shown)})"


def _bases(node: ast.ClassDef, module: str) -> Iterator[tuple[ast.ClassDef, str]]:
    """Classes of the project that a class inherits from, each with the module that defines it."""
    names = {ast.unparse(b.value if isinstance(b, ast.Subscript) else b) for b in node.bases}
    for found in ast.parse(_file(module).read_text(encoding="utf-8")).body:
        if isinstance(found, ast.ImportFrom) and (found.module or "").split(".")[0] in ROOMS:
            for name in names & {a.name for a in found.names}:
                base, _ = definition(found.module or "", name)
                if isinstance(base, ast.ClassDef):
                    yield base, found.module or ""


def _members(node: ast.ClassDef, module: str) -> Iterator[str]:
    """Public methods, properties and documented attributes of a class, then those of its bases in other modules."""
    body = node.body
    for i, inner in enumerate(body):
        if isinstance(inner, ast.FunctionDef) and not inner.name.startswith("_"):
            kinds = [ast.unparse(d) for d in inner.decorator_list]
            text = markdown(ast.get_docstring(inner) or "")
            if "property" in kinds:
                yield _directive("py:property", inner.name, text, 4)
            else:
                static = "staticmethod" in kinds
                option = ":classmethod:" if "classmethod" in kinds else ":staticmethod:" if static else ""
                yield _directive("py:method", inner.name + signature(inner, not static), text, 4, option)
        elif isinstance(inner, ast.Assign | ast.AnnAssign) and (text := _text_below(body, i)):
            target = inner.targets[0] if isinstance(inner, ast.Assign) else inner.target
            yield _directive("py:attribute", ast.unparse(target), markdown(text), 4)
    for made in body:
        if isinstance(made, ast.FunctionDef) and made.name == "__init__":
            for i, inner in enumerate(made.body):
                target = inner.targets[0] if isinstance(inner, ast.Assign) else getattr(inner, "target", None)
                if isinstance(target, ast.Attribute) and (text := _text_below(made.body, i)):
                    yield _directive("py:attribute", target.attr, markdown(text), 4)
    for base, where in _bases(node, module):
        yield from _members(base, where)


def _directive(kind: str, head: str, body: str, fence: int, option: str = "") -> str:
    ticks = "`" * fence
    return "\n".join([f"{ticks}{{{kind}}} {head}", *([option] if option else []), "", body, ticks])


def entry(room: str, name: str) -> str:
    """What the reference says on one name."""
    module = ".".join(filter(None, (room, _origins(room)[name])))
    node, docstring = definition(module, name)
    text = markdown(docstring)
    if isinstance(node, ast.FunctionDef):
        return _directive("py:function", name + signature(node, drop_first=False), text, 5)
    if isinstance(node, ast.ClassDef):
        body = "\n\n".join([text, *_members(node, module)])
        return _directive("py:class", name + _constructor(node, module), body, 5)
    return _directive("py:data", name, text, 5)


def page(room: str) -> str:
    """The page of a room."""
    entries = "\n\n".join(entry(room, name) for name in names(room))
    return f"# {room}\n\n{ROOMS[room]}\n\n```{{py:module}} {room}\n```\n\n{entries}\n"


def write(*_: Any) -> None:
    """Write the pages to docs/api; a page that has not changed is not touched."""
    FOLDER.mkdir(exist_ok=True)
    toc = "\n".join(ROOMS)
    pages = {room: page(room) for room in ROOMS}
    pages["index"] = (
        "# Reference\n\nThe public face of each room, from its docstrings. Shapes and units stand in the text.\n\n"
        f"```{{toctree}}\n{toc}\n```\n"
    )
    for name, text in pages.items():
        path = FOLDER / f"{name}.md"
        if not path.exists() or path.read_text(encoding="utf-8") != text:
            path.write_text(text, encoding="utf-8")


def setup(app: Any) -> dict[str, bool]:
    """A Sphinx extension."""
    app.connect("builder-inited", write)
    return {"parallel_read_safe": True}
