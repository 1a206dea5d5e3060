"""Enforce by inequality: margins become rows, rows and a task a QP, and its answer is verified.

Names are imported when they are first used; `__init__.pyi` lists them.
"""

from importlib.util import find_spec
from pathlib import Path

import lazy_loader

for _sister in ("admittance", "primitives", "scenarios"):
    _spec = find_spec(_sister)
    _found = Path(_spec.origin).parent if _spec is not None and _spec.origin else None
    if _found != Path(__file__).parent.parent / _sister:
        raise ImportError(
            f'"{_sister}" must lie beside {Path(__file__).parent}, found {_found}: another package of that name comes '
            "first on sys.path; install active-constraints into an environment of its own"
        )

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
