"""A table of named things: the files of a folder, those of installed plug-ins, and those registered by hand.

One file in the folder adds a thing; from outside, `register` or an entry point ``active_constraints.<kind>`` does.
"""

from collections.abc import Callable
from importlib import import_module
from importlib.metadata import entry_points
from pkgutil import iter_modules
from types import ModuleType
from typing import Generic, TypeVar

from primitives.errors import InputError, UnknownNameError

T = TypeVar("T")


class Registry(Generic[T]):
    """Things of one kind by name; the built-in ones are imported when first asked for.

    Parameters
    ----------
    kind : what the things are, e.g. "pair"; the entry-point group is ``active_constraints.<kind>s``.
    package : folder whose modules each define one built-in thing.
    attribute : name under which each of these modules, or an entry point, holds its thing.
    check : called with a thing before it is accepted; raises InputError.
    """

    def __init__(self, kind: str, package: ModuleType, attribute: str, check: Callable[[T], object]):
        self.kind, self._package, self._attribute, self._check = kind, package, attribute, check
        self._things: dict[str, T] = {}
        self._loaded = False

    def _load(self) -> None:
        if self._loaded:
            return
        self._loaded = True
        try:
            for module in iter_modules(self._package.__path__):
                thing = getattr(import_module(f"{self._package.__name__}.{module.name}"), self._attribute, None)
                if thing is not None:
                    self._add(thing)
            for plugin in entry_points(group=f"active_constraints.{self.kind}s"):
                self._add(plugin.load())
        except BaseException:
            self._loaded = False  # or the next to ask would find a part of them, without a word
            raise

    def _add(self, thing: T) -> T:
        self._check(thing)
        name = str(getattr(thing, "name"))  # noqa: B009
        if self._things.get(name, thing) is not thing:
            raise InputError(f'{self.kind} "{name}" is registered already; give yours another name')
        self._things[name] = thing
        return thing

    def register(self, thing: T) -> T:
        """Make a thing known under its `name`.

        Raises
        ------
        InputError : the name is taken, or the thing does not pass the kind's check.
        """
        self._load()
        return self._add(thing)

    def __getitem__(self, name: str) -> T:
        """The thing of that name; raises UnknownNameError, which proposes the nearest name."""
        self._load()
        if name not in self._things:
            raise UnknownNameError(self.kind, str(name), self._things)
        return self._things[name]

    def names(self) -> tuple[str, ...]:
        """Every known name, sorted."""
        self._load()
        return tuple(sorted(self._things))
