"""The reference has every public name, with the arguments that it really takes."""

import inspect
from importlib import import_module

import pytest

from docs.reference import ROOMS, markdown, names, page


def heads(room: str) -> dict[str, str]:
    """{name: what the page says that it is called with} of the entries on the first level."""
    found = [line.partition(" ")[2] for line in page(room).splitlines() if line.startswith("`````{")]
    return {head.partition("(")[0]: head for head in found}


@pytest.mark.parametrize("room", ROOMS)
def test_every_public_name_has_an_entry_with_its_text(room):
    face = import_module(room)
    assert heads(room).keys() == set(face.__all__) == set(names(room))
    text = page(room)
    for name in face.__all__:
        thing = getattr(face, name)
        if inspect.isclass(thing) or inspect.isfunction(thing):
            first = markdown(inspect.cleandoc(thing.__doc__).split("\n\n")[0])
            assert first in text, name


@pytest.mark.parametrize("room", ROOMS)
def test_arguments_are_those_of_the_code(room):
    """`inspect` knows them from the running code, the page from its source."""
    face, checked = import_module(room), 0
    for name, head in heads(room).items():
        thing = getattr(face, name)
        if inspect.isfunction(thing) and "(" in head:
            shown = eval(f"lambda {head.partition('(')[2][:-1]}: 0", {**vars(import_module(thing.__module__))})
            assert [*inspect.signature(shown).parameters] == [*inspect.signature(thing).parameters], name
            checked += 1
        elif inspect.isclass(thing) and "__init__" in vars(thing) and "(" in head and not hasattr(thing, "_fields"):
            for parameter in inspect.signature(thing).parameters:
                assert parameter in head, f"{name}: {parameter}"
            checked += 1
    assert checked


def test_what_markdown_would_take_for_markup_stands_for_itself():
    assert markdown("a_i * b_j, |x| in [0, 1] and `code_here`") == r"a\_i \* b\_j, \|x\| in \[0, 1\] and `code_here`"


def test_sections_become_lists():
    lines = "Parameters\n----------\na : one,\n    and on.\nb : two. c : three."
    text = f"Head.\n\n{lines}\n\nRaises\n------\nInputError : why."
    assert markdown(text).split("\n\n") == [
        "Head.",
        "**Parameters**",
        "- **a**: one, and on.\n- **b**: two.\n- **c**: three.",
        "**Raises**",
        "- **InputError**: why.",
    ]
