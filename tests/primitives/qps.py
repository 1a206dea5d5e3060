"""Random strictly convex QPs of every kind a controller may pose, a caller of the kernel, and certificates.

A certificate is computed in extended precision from the problem and the answer alone: the duality gap bounds the
distance from the true minimiser, whoever found the answer.
"""

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog

from primitives.active_set import solve, work_rows
from primitives.compiled import JIT_DISABLED
from vfi.qp import SolverStatus

Array = NDArray[np.float64]
Long = np.longdouble


def cases(full: int, as_python: int) -> int:
    """How many cases to try: `as_python` where nothing is compiled (NUMBA_DISABLE_JIT)."""
    return as_python if JIT_DISABLED else full


class Problem(NamedTuple):
    H: Array
    g: Array
    A: Array
    b: Array
    low: Array
    high: Array
    kinds: frozenset[str] = frozenset()


class Answer(NamedTuple):
    status: SolverStatus
    x: Array
    multiplier: Array
    active: tuple[int, ...]


class Workspace:
    """The kernel's arguments beyond the problem, kept from call to call like a controller does."""

    def __init__(self, n: int, m: int):
        self.x, self.multiplier = np.zeros(n), np.zeros(m + 2 * n)
        self.active, self.mask = np.zeros(n + 2, dtype=np.int64), np.zeros(m + 2 * n, dtype=np.int64)
        self.scale, self.work = np.zeros(m), np.zeros((work_rows(n), n))

    def solve(self, p: Problem) -> Answer:
        status = solve(*p[:6], self.x, self.multiplier, self.active, self.mask, self.scale, self.work)
        assert not self.mask.any(), "the mask must come back as zeros"
        listed = tuple(int(k) for k in self.active[1 : 1 + self.active[0]])
        return Answer(SolverStatus(status), self.x.copy(), self.multiplier.copy(), listed)


def solved(p: Problem, warm: Any = ()) -> Answer:
    """The kernel's answer from fresh scratch; `warm` are the rows that it is told were active."""
    w = Workspace(len(p.g), len(p.b))
    w.active[0] = len(warm)
    w.active[1 : 1 + len(warm)] = list(warm)[: len(w.active) - 1]
    return w.solve(p)


def plain(H: Any, g: Any, A: Any = (), b: Any = (), low: Any = None, high: Any = None) -> Problem:
    """A problem from lists; bounds that are not given are infinite."""
    g = np.array(g, dtype=float)
    n = len(g)
    A, b = np.array(A, dtype=float).reshape(-1, n), np.array(b, dtype=float)
    low = np.full(n, -np.inf) if low is None else np.array(low, dtype=float)
    high = np.full(n, np.inf) if high is None else np.array(high, dtype=float)
    return Problem(np.array(H, dtype=float), g, A, b, low, high)


ALL_KINDS = ("duplicated", "opposed", "parallel", "dependent", "vertex", "zero", "unbounded", "fixed", "free gradient")


def random_problem(rng: np.random.Generator, n: int, m: int, kinds: frozenset[str] | None = None) -> Problem:
    """A problem of n variables and m rows; `kinds` is drawn where not given.

    H = J^T J + lambda I as a controller has it, lambda from 1e-8 to 1 and J of 1 to 8 rows; row norms from 1e-4 to
    1e2. "infeasible" problems may happen to be feasible; all others have a feasible point, x0.
    """
    if kinds is None:
        chosen = {k for k in ALL_KINDS if rng.random() < 0.2}
        kinds = frozenset(chosen | ({"infeasible"} if rng.random() < 0.25 else set()))
    damping = 10.0 ** rng.uniform(-8.0, 0.0)
    J = rng.normal(size=(int(rng.integers(1, 9)), n)) * 10.0 ** rng.uniform(-1.0, 0.5)
    H = J.T @ J + damping * np.eye(n)
    g = J.T @ rng.normal(size=len(J)) * 10.0 ** rng.uniform(-1.0, 1.0)
    if "free gradient" in kinds:
        g = rng.normal(size=n) * 10.0 ** rng.uniform(-2.0, 1.0)
    A, b, low, high = _constraints(rng, n, m, kinds)
    return Problem(H, g, A, b, low, high, kinds)


def _constraints(rng: np.random.Generator, n: int, m: int, kinds: frozenset[str]) -> tuple[Array, Array, Array, Array]:
    A = rng.normal(size=(m, n))
    x0 = rng.normal(size=n)
    for i in range(1, m):
        other = A[int(rng.integers(i))]
        draw = rng.random()
        if "duplicated" in kinds and draw < 0.2:
            A[i] = other
        elif "opposed" in kinds and draw < 0.35:
            A[i] = -other
        elif "parallel" in kinds and draw < 0.5:
            A[i] = rng.choice([-1.0, 1.0]) * other + 10.0 ** rng.uniform(-12.0, -2.0) * rng.normal(size=n)
        elif "dependent" in kinds and draw < 0.7:
            A[i] = rng.normal(size=i) @ A[:i]
    A *= 10.0 ** rng.uniform(-4.0, 2.0, size=(m, 1)) / np.maximum(np.linalg.norm(A, axis=1, keepdims=True), 1e-30)
    norms = np.linalg.norm(A, axis=1)
    room = rng.exponential(0.3, size=m)
    if "infeasible" in kinds:
        room -= 0.5 * (rng.random(m) < 0.3)
    if "vertex" in kinds:
        room[rng.random(m) < 0.5] = 0.0
    b = A @ x0 - norms * room
    if "zero" in kinds and m:
        rows = rng.random(m) < 0.15
        A[rows] = 0.0
        b[rows] = -rng.random(rows.sum()) * rng.integers(0, 2)
    b[rng.random(m) < 0.1] = -np.inf
    low, high = x0 - rng.exponential(1.0, size=n), x0 + rng.exponential(1.0, size=n)
    if "unbounded" in kinds:
        low[rng.random(n) < 0.5], high[rng.random(n) < 0.5] = -np.inf, np.inf
    if "fixed" in kinds:
        still = rng.random(n) < 0.3
        low[still] = high[still] = x0[still]
    return A, b, low, high


def unit_rows(p: Problem) -> tuple[Array, Array, NDArray[np.int64]]:
    """All rows and bounds in force as unit rows N x >= c, and their numbers in the kernel's count."""
    n = p.A.shape[1]
    norms = np.linalg.norm(p.A, axis=1)
    N = np.vstack([p.A, np.eye(n), -np.eye(n)])
    c = np.concatenate([p.b, p.low, -p.high])
    lengths = np.concatenate([norms, np.ones(2 * n)])
    kept = np.flatnonzero((lengths > 0.0) & (c > -np.inf))
    return N[kept] / lengths[kept, None], c[kept] / lengths[kept], kept


class Residuals(NamedTuple):
    """How far an answer is from the conditions of Karush, Kuhn and Tucker; all zero for the exact minimiser.

    violation : of the worst unit row, relative to 1 + |x|. negative : size of the most negative multiplier.
    loose : largest |slack| of a unit row whose multiplier is not zero, relative to 1 + |x|.
    gradient : |H x + g - N^T y| relative to the sizes of its summands.
    distance : bound on |x - x*| in the metric of H, relative to 1 + |x|, that follows from these by the duality gap.
    """

    violation: float
    negative: float
    loose: float
    gradient: float
    distance: float


def residuals(p: Problem, x: Array, multiplier: Array) -> Residuals:
    H, g, x = p.H.astype(Long), p.g.astype(Long), x.astype(Long)
    n = len(g)
    N, c = np.vstack([p.A, np.eye(n), -np.eye(n)]).astype(Long), np.concatenate([p.b, p.low, -p.high]).astype(Long)
    held = c > -np.inf
    y = multiplier.astype(Long)
    assert not y[~held].any(), "a row that is not in force has a multiplier"
    N, c, y = N[held], c[held], y[held]
    lengths = np.sqrt((N * N).sum(axis=1))
    slack = (N @ x - c) / np.where(lengths > 0.0, lengths, 1.0)
    loose = slack / (1.0 + np.abs(x).max())
    error = H @ x + g - N.T @ y
    size = 1.0 + np.abs(H) @ np.abs(x) + np.abs(g) + np.abs(N).T @ np.abs(y)
    # x is the exact minimiser for the gradient g - error, but for a gap of sum y slack.
    gap, moved = np.abs(y * lengths * slack).sum(), max(float(error @ _solve_long(H, error)), 0.0)
    distance = (np.sqrt(2.0 * gap) + np.sqrt(moved)) / (1.0 + np.sqrt(x @ H @ x))
    parts = (-loose, -y * lengths, np.abs(loose[y > 0.0]), np.abs(error / size))
    return Residuals(*(max(0.0, float(part.max(initial=0.0))) for part in parts), float(distance))


def objective(p: Problem, x: Array) -> float:
    return float(0.5 * x @ p.H @ x + p.g @ x)


def _solve_long(H: NDArray[Any], e: NDArray[Any]) -> NDArray[Any]:
    """H^-1 e by Cholesky in extended precision."""
    n = len(e)
    L = np.zeros_like(H)
    for i in range(n):
        for j in range(i + 1):
            total = H[i, j] - L[i, :j] @ L[j, :j]
            L[i, j] = np.sqrt(total) if i == j else total / L[j, j]
    z = np.zeros_like(e)
    for i in range(n):
        z[i] = (e[i] - L[i, :i] @ z[:i]) / L[i, i]
    out = np.zeros_like(e)
    for i in range(n - 1, -1, -1):
        out[i] = (z[i] - L[i + 1 :, i] @ out[i + 1 :]) / L[i, i]
    return out


FAR = 1e6
"""Rows count as contradicting each other where no x with all |x_i| within this satisfies them."""


def least_violation(N: Array, c: Array) -> float:
    """Smallest t >= -1 for which N x >= c - t has a solution within FAR, by HiGHS; > 0 where the rows conflict."""
    n = N.shape[1]
    problem = {
        "c": np.r_[np.zeros(n), 1.0],
        "A_ub": np.c_[-N, -np.ones(len(N))],
        "b_ub": -c,
        "bounds": [(-FAR, FAR)] * n + [(-1.0, None)],
    }
    found = linprog(**problem, method="highs")
    if found.status != 0:
        found = linprog(**problem, method="highs-ipm")
    assert found.status == 0, found.message
    return float(found.fun)
