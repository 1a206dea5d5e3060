"""Searches of the joint box: sampled configurations first, then SLSQP from the most promising of them.

Neither proves that something is not there; what was not found is said together with how it was looked for. The seed
is fixed, so the same scene gives the same answer.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import minimize

from primitives.checks import Array
from scenarios.check.space import Sight, Space

SEED = 0
SAMPLES = 400
"""Configurations that are drawn."""
STARTS = 6
"""Of them and the scene's start, how many a search begins from."""
CLOSE = 1e-6
"""What counts as kept, metres or radians: an optimum on a boundary is met no better."""
_STEPS, _ITERATIONS = 12, 80
_FINE = 10.0
"""Weight of a violation against the margin that is minimised, when samples are chosen."""
_SCALE = 100.0
"""Margins are handed over in centimetres: near in size to the joints."""


class Found(NamedTuple):
    """The best of a search: a configuration (d,) and the value there; infinite where none keeps what it must."""

    x: Array
    value: float


class Search:
    """The box of a `Space` with samples in it, which every question shares.

    Attributes
    ----------
    samples : (s, d) configurations, the scene's start first; all pass the port, where there is one.
    margins : (s, m) of the constraints there.
    """

    def __init__(self, space: Space):
        self.space = space
        rng = np.random.default_rng(SEED)
        drawn = rng.uniform(space.low, space.high, (SAMPLES, len(space.low)))
        kept = [space.first, *(x for d in drawn if (x := self._through_port(d)) is not None)]
        self.samples = np.array(kept)
        self.margins = np.array([space.at(x).margin for x in kept])
        self._last: tuple[bytes, Sight] | None = None

    @property
    def method(self) -> str:
        """How things were looked for, in words."""
        port = "" if self.space.port is None else " that pass the port"
        return (
            f"{len(self.samples) - 1} configurations within the joint limits{port}, drawn with seed {SEED}; then "
            f"sequential quadratic programming from the best {STARTS}"
        )

    def smallest(self, i: int, keep: Sequence[int] = ()) -> Found:
        """The configuration of the smallest margin i among those where the margins `keep` are not negative."""
        order = self._order(self.margins[:, i], keep)
        return self._best(
            order,
            lambda x: float(self._sight(x).margin[i]),
            lambda x: self._sight(x).row[i],
            keep,
        )

    def roomiest(self, which: Sequence[int]) -> Found:
        """The configuration where the smallest of some margins is largest; the value is that margin."""
        chosen, best = list(which), None
        values = self.margins[:, chosen].min(axis=1)
        for k in np.argsort(-values)[:STARTS]:
            x = self._raised(self.samples[k], float(values[k]), chosen)
            value = float(self._sight(x).margin[chosen].min())
            if self._allowed(x, ()) and (best is None or value > best.value):
                best = Found(x, value)
            if best is not None and best.value > 0.0:
                break
        return best or Found(self.space.first, -np.inf)

    def _raised(self, start: Array, value: float, which: list[int]) -> Array:
        """Maximise t, the last variable, subject to margin >= t."""
        d = len(start)
        bounds = [*zip(self.space.low, self.space.high, strict=True), (None, None)]
        conditions = [
            {
                "type": "ineq",
                "fun": lambda z: _SCALE * self._sight(z[:d]).margin[which] - z[d],
                "jac": lambda z: np.c_[_SCALE * self._sight(z[:d]).row[which], -np.ones(len(which))],
            },
            *self._port_condition(d + 1),
        ]
        slope = np.r_[np.zeros(d), -1.0]
        return self._solve(lambda z: float(-z[d]), lambda z: slope, np.r_[start, _SCALE * value], bounds, conditions)[
            :d
        ]

    def _best(
        self, order: list[int], value: Callable[[Array], float], slope: Callable[[Array], Array], keep: Sequence[int]
    ) -> Found:
        best, bounds = Found(self.space.first, np.inf), list(zip(self.space.low, self.space.high, strict=True))
        conditions, held = self._port_condition(len(bounds)), list(keep)
        if held:
            rows = {
                "type": "ineq",
                "fun": lambda x: _SCALE * self._sight(x).margin[held],
                "jac": lambda x: _SCALE * self._sight(x).row[held],
            }
            conditions.append(rows)
        for start in self.samples[order]:
            x = self._solve(lambda x: _SCALE * value(x), lambda x: _SCALE * slope(x), start, bounds, conditions)
            for candidate in (start, x):
                if self._allowed(candidate, held) and value(candidate) < best.value:
                    best = Found(candidate, value(candidate))
            if best.value < -CLOSE:
                break
        return best

    def _solve(
        self,
        value: Callable[[Array], float],
        slope: Callable[[Array], Array],
        start: Array,
        bounds: list[tuple[float | None, float | None]],
        conditions: list[dict[str, object]],
    ) -> Array:
        options = {"maxiter": _ITERATIONS, "ftol": 1e-10}
        out = minimize(value, start, jac=slope, bounds=bounds, constraints=conditions, method="SLSQP", options=options)
        x: Array = np.where(np.isfinite(out.x), out.x, start)
        d = len(self.space.low)
        x[:d] = np.clip(x[:d], self.space.low, self.space.high)
        return x

    def _order(self, values: Array, keep: Sequence[int]) -> list[int]:
        """Samples by value, those that violate the least of what must be kept first; the scene's start among them."""
        short = np.maximum(-self.margins[:, list(keep)], 0.0).sum(axis=1)
        return list(dict.fromkeys([*np.argsort(values + _FINE * short)[:STARTS].tolist(), 0]))

    def _allowed(self, x: Array, keep: Sequence[int]) -> bool:
        sight = self._sight(x)
        kept = bool(np.all(sight.margin[list(keep)] >= -CLOSE)) if keep else True
        return kept and bool(np.all(np.abs(sight.port) <= CLOSE)) and bool(np.isfinite(sight.margin).all())

    def _port_condition(self, variables: int) -> list[dict[str, object]]:
        if self.space.port is None:
            return []
        pad = variables - len(self.space.low)
        d = len(self.space.low)
        return [
            {
                "type": "eq",
                "fun": lambda z: _SCALE * self._sight(z[:d]).port,
                "jac": lambda z: np.c_[_SCALE * self._sight(z[:d]).port_row, np.zeros((2, pad))],
            }
        ]

    def _sight(self, x: Array) -> Sight:
        """What SLSQP asks for several times at the same place is evaluated once."""
        key = x.tobytes()
        if self._last is None or self._last[0] != key:
            self._last = key, self.space.at(np.ascontiguousarray(x))
        return self._last[1]

    def _through_port(self, x: Array) -> Array | None:
        """The configuration moved until the shaft passes the port; None where it does not come to that."""
        if self.space.port is None:
            return x
        for _ in range(_STEPS):
            off, row = self.space.port_at(self.space.kinematics(x))
            if np.all(np.abs(off) <= 0.1 * CLOSE):
                return x
            x = np.clip(x - np.linalg.pinv(row) @ off, self.space.low, self.space.high)
        return None
