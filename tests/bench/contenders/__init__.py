"""One file a way to write the cycle. `contenders()` makes them all, and says which could not be imported."""

from importlib import import_module

FILES = ("ours", "ours_in_full", "dq_robotics", "pink_ik", "mink_ik", "by_hand", "no_op")


def contenders():
    """Contenders in the order of the table, and {file: why it is missing}."""
    found, missing = [], {}
    for file in FILES:
        try:
            module = import_module(f"{__name__}.{file}")
        except ImportError as error:
            missing[file] = str(error)
        else:
            found += [make() for make in module.CONTENDERS]
    return found, missing
