"""`Enforcement`: how the declared constraints of a scene are kept. The same for every kind of scene."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any, NamedTuple, Protocol, Self, TypeVar

from primitives.checks import known, number
from primitives.constraint import ConstraintSet
from primitives.errors import InputError
from vfi.forms import EQUALITY, ROWS, PortForm, Soft, form_of_each

METHODS = ("none", "admittance", "vfi", "both")
"""Who keeps the constraints: nobody, potentials of an admittance, inequalities of a controller, or both."""
BY_ROWS = ("vfi", "both")
"""Methods in which inequalities keep the constraints."""
GUARDS = ("off", "watch", "act")
METRICS = ("free", "joints")
"""In which a hand's motion is projected: that of the admittance's inertia and damping, or the joints' (not passive)."""
FORMS = (ROWS, EQUALITY, "soft")
"""Forms of an entry port by name; "soft" has a weight besides."""

Gains = float | Mapping[str, float]
"""1/s, one number or {constraint: gain} with "" for the others."""


class InForce(NamedTuple):
    """An `Enforcement` with what its kind of scene does in the place of all that it leaves open."""

    method: str
    eta: Gains
    limit_eta: float
    guard: str
    metric: str
    reach: float
    forms: Mapping[str, PortForm]

    @property
    def by_rows(self) -> bool:
        """Whether inequalities keep the constraints."""
        return self.method in BY_ROWS

    def eta_of(self, name: str) -> float | None:
        """The gain of a constraint, 1/s; None where it has none."""
        return self.eta.get(name, self.eta.get("")) if isinstance(self.eta, Mapping) else self.eta


@dataclass(frozen=True)
class Enforcement:
    """How constraints are kept; what is None is left to the kind of scene, see docs/scenes.md.

    Attributes
    ----------
    method : "none", "vfi", "admittance" or "both".
    eta : gain of the inequalities, 1/s, one number or {constraint: gain} with "" for the others.
    limit_eta : gain of the joint-position limits, 1/s.
    guard : what verification does with a command that would leave a boundary: "act", only "watch", or "off".
    metric : "free" or "joints", of a hand's motion where it is projected onto the inequalities.
    reach : up to which margin the points of a cloud get inequalities, metres.
    forms : {entry port: "rows", "equality" or `vfi.forms.Soft`}, how it is kept.

    Raises
    ------
    InputError, UnknownNameError : a number that is not > 0, an unknown name.
    """

    method: str | None = None
    eta: Gains | None = None
    limit_eta: float | None = None
    guard: str | None = None
    metric: str = "free"
    reach: float | None = None
    forms: Mapping[str, PortForm] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.method is not None:
            known("enforcement", self.method, METHODS)
        if self.guard is not None:
            known("guard", self.guard, GUARDS)
        known("metric", self.metric, METRICS)
        for gain in self.eta.values() if isinstance(self.eta, Mapping) else [self.eta]:
            if gain is not None:
                number(gain, "eta of the enforcement", positive=True)
        for name in ("limit_eta", "reach"):
            if getattr(self, name) is not None:
                number(getattr(self, name), f"{name} of the enforcement", positive=True)
        for form in self.forms.values():
            if not isinstance(form, Soft):
                known("form of a port", form, FORMS[:2])

    def check(self, constraints: ConstraintSet) -> None:
        """Refuse names that are none of these constraints, and forms of those that are no entry ports.

        Raises
        ------
        UnknownNameError, InputError : such a name or form.
        """
        for name in self.eta if isinstance(self.eta, Mapping) else ():
            if name:
                known("constraint", name, constraints.names)
        form_of_each(constraints, self.forms)

    def in_force(self, default: InForce) -> InForce:
        """What holds where a kind of scene does this by default."""
        own = {name: value for name in InForce._fields if (value := getattr(self, name)) is not None}
        return default._replace(**own)


OPEN = Enforcement()
"""Everything as the kind of scene does it."""


def check_led_along(enforcement: Enforcement, hand: bool) -> None:
    """Refuse what needs a hand where a trajectory is followed without one; raises InputError."""
    if hand:
        return
    if enforcement.method not in (None, "none", "vfi"):
        raise InputError(
            f'enforcement "{enforcement.method}": a scene that follows a trajectory by itself has no admittance, so it '
            'takes "none" or "vfi"; give it the keys hand and admittance, as S1-hand does, to have its tool led'
        )
    if enforcement.metric != METRICS[0]:
        raise InputError(f'metric "{enforcement.metric}": it is of a hand\'s motion, and no hand leads this scene')


class _Enforced(Protocol):
    """A scene of any kind."""

    @property
    def enforcement(self) -> Enforcement:
        """How it is enforced."""

    def with_changes(self, **changes: Any) -> Self:
        """The scene with other values."""


S = TypeVar("S", bound=_Enforced)
"""A kind of scene."""


def chosen(
    scene: S, *, enforcement: str | None = None, guard: str | None = None, metric: str | None = None, **others: Any
) -> S:
    """A scene with what is not None in the place of its own: of its enforcement, and other attributes."""
    changes = {name: value for name, value in others.items() if value is not None}
    given = {"method": enforcement, "guard": guard, "metric": metric}
    own: dict[str, Any] = {name: value for name, value in given.items() if value is not None}
    return scene.with_changes(**changes, enforcement=replace(scene.enforcement, **own)) if changes or own else scene
