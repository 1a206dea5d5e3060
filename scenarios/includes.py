"""Files beside a scene file: named sets of constraints that several scenes use, and which files can be reached.

    include: [ports.yaml]          # whose `sets: {port: [...], walls: [...]}` hold lists of constraints
    use: [port, walls]             # joined behind the scene's own constraints, as `set_a + set_b` joins them

A file may hold `sets` of its own; an included file holds nothing but `sets` and further files to `include`. A file that
is reached in two ways counts once.
"""

from pathlib import Path
from typing import Any

from primitives.errors import InputError, UnknownNameError
from primitives.files.document import Document, Mark, Problem, ValuePath
from primitives.files.model import show
from primitives.files.yaml_file import read
from primitives.spec import declared_names

MAX_FILES = 4
"""Most files that one scene may be spread over, one upon the other, and that one file may include."""
KEYS = ("include", "sets", "use")

_Sets = dict[str, tuple[Document, list[Any]]]


def beside(path: Path, name: Any, users: tuple[Path, ...]) -> Path:
    """The file called name beside a file; no other place can be reached, and none of the files that use it.

    Raises
    ------
    InputError, UnknownNameError : no such file, a link out of the folder, a circle, or too many files.
    """
    if not isinstance(name, str):
        raise InputError(f"expected the name of a file in the same folder, got {show(name)}")
    known = sorted(p.name for p in path.parent.glob("*.yaml"))
    if name not in known:
        raise UnknownNameError("file in this folder", name[:100], known)
    found = path.parent / name
    if found.resolve().parent != path.parent.resolve():
        raise InputError(f"{name} is a link out of this folder; copy the file here")
    chain = " -> ".join(p.name for p in (*users, found))
    if found.resolve() in [user.resolve() for user in users]:
        raise InputError(f"{chain} goes in a circle; remove one of these files")
    if len(users) >= MAX_FILES:
        raise InputError(f"{chain}: expected at most {MAX_FILES} files; join some")
    return found


def with_sets(document: Document, path: Path) -> Document:
    """The document with the constraints of the sets that it uses behind its own, each at the line of its own file."""
    data = document.data
    if not isinstance(data, dict) or not any(key in data for key in KEYS):
        return document
    problems, sets = list(document.problems), _Sets()
    _collect(document, path, (path,), sets, problems, set())
    use = data.get("use", [])
    if not isinstance(use, list):
        problems.append(_problem(document, ("use",), f"expected a list of sets, got {show(use)}"))
        use = []
    rest = {key: value for key, value in data.items() if key not in KEYS}
    joined = rest.get("constraints", [])
    if not isinstance(joined, list):
        return Document(rest, document.marks, tuple(problems))
    joined, marks = list(joined), dict(document.marks)
    marks.setdefault(("constraints",), document.mark(("use",)))
    for i, name in enumerate(use):
        if not isinstance(name, str) or name not in sets:
            text = str(UnknownNameError("set of constraints", str(name)[:60], sets))
            problems.append(_problem(document, ("use", i), text))
            continue
        source, items = sets[name]
        for place, mark in source.marks.items():
            if place[:2] == ("sets", name) and len(place) > 2 and isinstance(place[2], int):
                marks[("constraints", len(joined) + place[2], *place[3:])] = mark
        joined += items
    result = Document({**rest, "constraints": joined}, marks)
    return Document(result.data, marks, (*problems, *_repeated(result)))


def _collect(
    document: Document, path: Path, users: tuple[Path, ...], sets: _Sets, problems: list[Problem], seen: set[Path]
) -> None:
    """Gather the sets of a document and of the files that it includes, but for those that were seen."""
    own, include = document.data.get("sets", {}), document.data.get("include", [])
    if not isinstance(own, dict):
        problems.append(_problem(document, ("sets",), f"expected names and their lists, got {show(own)}"))
        own = {}
    for name, items in own.items():
        place: ValuePath = ("sets", name)
        if name in sets:
            before = sets[name][0].mark(place)
            problems.append(_problem(document, place, f"this set is declared at {before} already; rename one"))
        elif not isinstance(items, list):
            problems.append(_problem(document, place, f"expected a list of constraints, got {show(items)}"))
        else:
            sets[name] = document, items
    if not isinstance(include, list) or len(include) > MAX_FILES:
        problems.append(_problem(document, ("include",), f"expected a list of at most {MAX_FILES} files"))
        include = []
    for i, name in enumerate(include):
        try:
            file = beside(path, name, users)
        except InputError as error:
            problems.append(_problem(document, ("include", i), str(error)))
            continue
        if file in seen:
            continue
        seen.add(file)
        below = read(file)
        problems += below.problems
        if not isinstance(below.data, dict):
            problems.append(_problem(below, (), f"expected sets of constraints, got {show(below.data)}"))
            continue
        for key in below.data.keys() - {"include", "sets"}:
            problems.append(_problem(below, (key,), str(UnknownNameError("key of an included file", key, KEYS[:2]))))
        _collect(below, file, (*users, file), sets, problems, seen)


def _repeated(document: Document) -> list[Problem]:
    """Constraints of one name, told with both places."""
    first: dict[str, Mark] = {}
    found = []
    for i, name in enumerate(declared_names(document.data["constraints"])):
        place = "constraints", i, "name"
        if name is not None and name in first:
            text = f'constraint "{name[:60]}" is declared at {first[name]} already; rename one'
            found.append(Problem(document.mark(place), place, text))
        elif name is not None:
            first[name] = document.mark(place)
    return found


def _problem(document: Document, place: ValuePath, text: str) -> Problem:
    prefix = f"{place[0]}: " if place else ""
    return Problem(document.mark(place), place, prefix + text)
