"""Passive target admittance: active constraints enforced by a barrier potential, or a hand's reference velocity.

The method of Kastritsi & Doulgeri: the hand's wrench drives a target admittance in the free-motion coordinates of the
remote center of motion (RCM), while barrier potentials and variable damping keep tip and tool out of forbidden
regions. The room knows `primitives` only; where its reference velocity is projected onto vector-field inequalities,
`scenarios` wires the two together.

Names are imported when they are first used; `__init__.pyi` lists them.
"""

from importlib.util import find_spec
from pathlib import Path

import lazy_loader

for _sister in ("primitives", "scenarios", "vfi"):
    _spec = find_spec(_sister)
    _found = Path(_spec.origin).parent if _spec is not None and _spec.origin else None
    if _found != Path(__file__).parent.parent / _sister:
        raise ImportError(
            f'"{_sister}" must lie beside {Path(__file__).parent}, found {_found}: another package of that name comes '
            "first on sys.path; install active-constraints into an environment of its own"
        )

__getattr__, __dir__, __all__ = lazy_loader.attach_stub(__name__, __file__)
