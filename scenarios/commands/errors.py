"""How every command says that its input is bad: one clear text on stderr, and an exit code of its own."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager

import typer

BAD_INPUT = 2


@contextmanager
def one_clear_line() -> Iterator[None]:
    """Turn the project's own errors into a line on stderr and exit code 2."""
    from primitives.errors import ActiveConstraintsError

    try:
        yield
    except ActiveConstraintsError as error:
        print(f"vfi: {error}", file=sys.stderr)
        raise typer.Exit(BAD_INPUT) from None
