"""Where two traces differ: what was run, the first command that differs, how far the runs part, and their figures."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from difflib import unified_diff
from typing import Any

import numpy as np

from primitives.checks import Array
from primitives.errors import InputError
from scenarios.analysis.kinds import BY_HAND
from scenarios.analysis.trace import Trace
from scenarios.scene import Scene

UNTOLD = frozenset({"cycle_us"})
"""Columns that tell of the machine, not of the run."""
SCENE = "resolved_scene"


@dataclass(frozen=True)
class Difference:
    """What differs between a run A and a run B; pairs are (of A, of B).

    Attributes
    ----------
    header : {key: pair} where they differ; of nested ones only the keys that do. scene : lines of the resolved scenes,
        "-" of A and "+" of B. columns : pairs of quantities that only one has.
    cycles : pair. first : cycle, t (s), quantity, joint and by (B - A) of the first command that differs, or None.
    apart : {quantity: {max, at_cycle, rms}} of q, q̇ and every margin or clearance, in their units, B - A over the
        cycles that both have. differing : every quantity that is not equal to the bit.
    events : pair of lists of changes of state, or None where they are equal. metrics : {key: pair} where they differ.
    without_metrics : why there are none, where the scene of a trace cannot be built.
    """

    header: Mapping[str, tuple[Any, Any]]
    scene: list[str]
    columns: tuple[list[str], list[str]]
    cycles: tuple[int, int]
    first: Mapping[str, Any] | None
    apart: Mapping[str, Mapping[str, float]]
    differing: list[str]
    events: tuple[list[Any], list[Any]] | None
    metrics: Mapping[str, tuple[Any, Any]]
    without_metrics: str

    @property
    def equal(self) -> bool:
        """Whether the runs are equal to the bit, apart from how long their cycles took."""
        same_length = self.cycles[0] == self.cycles[1]
        found = (self.header, self.scene, *self.columns, self.differing, self.events)
        return same_length and not any(found)

    def data(self) -> dict[str, Any]:
        """Plain data for JSON."""
        return {"equal": self.equal, **asdict(self)}


def compare_traces(a: Trace, b: Trace) -> Difference:
    """Compare two traces, cycle by cycle."""
    both = [name for name in a.columns if name in b.columns and name not in UNTOLD]
    count = min(len(a.records), len(b.records))
    pairs = {name: (_wide(a, name)[:count], _wide(b, name)[:count]) for name in both}
    differing = [name for name, (x, y) in pairs.items() if x.shape != y.shape or x.tobytes() != y.tobytes()]
    try:
        metrics, why = _metrics(a, b), ""
    except InputError as error:
        metrics, why = {}, str(error)
    events = ([e._asdict() for e in a.events], [e._asdict() for e in b.events])
    return Difference(
        _header(a.header, b.header),
        _scene_lines(a, b),
        (_lacking(a, b), _lacking(b, a)),
        (len(a.records), len(b.records)),
        _first(a, pairs),
        _apart(a, b, pairs),
        differing,
        events if events[0] != events[1] else None,
        metrics,
        why,
    )


def _wide(trace: Trace, name: str) -> Array:
    out: Array = np.ascontiguousarray(trace.records[:, trace.columns[name]])
    return out


def _lacking(trace: Trace, other: Trace) -> list[str]:
    return [name for name in trace.columns if name not in other.columns]


def flat(data: Mapping[str, Any], prefix: str = "") -> dict[str, Any]:
    """Nested keys joined with dots; lists stay whole."""
    out: dict[str, Any] = {}
    for key, value in data.items():
        out |= flat(value, f"{prefix}{key}.") if isinstance(value, Mapping) else {f"{prefix}{key}": value}
    return out


def _header(a: Mapping[str, Any], b: Mapping[str, Any]) -> dict[str, tuple[Any, Any]]:
    x, y = (flat({k: v for k, v in h.items() if k != SCENE}) for h in (a, b))
    return {key: (x.get(key), y.get(key)) for key in {**x, **y} if x.get(key) != y.get(key)}


def _scene_lines(a: Trace, b: Trace) -> list[str]:
    old, new = (str(t.header.get(SCENE, "")).splitlines() for t in (a, b))
    return [line for line in unified_diff(old, new, lineterm="", n=0) if not line.startswith(("---", "+++", "@@"))]


def _first(a: Trace, pairs: Mapping[str, tuple[Array, Array]]) -> dict[str, Any] | None:
    """The first cycle whose command differs, and the joint that differs most in it."""
    name = next((n for n in ("qdot", "q") if n in pairs and pairs[n][0].shape == pairs[n][1].shape), None)
    if name is None:
        return None
    x, y = pairs[name]
    rows = np.flatnonzero((x.view(np.uint64) != y.view(np.uint64)).any(axis=1))
    if not len(rows):
        return None
    k = int(rows[0])
    joint = int(np.argmax(np.abs(y[k] - x[k])))
    names = a.header.get("decided" if name == "qdot" else "joints", [])
    called = names[joint] if joint < len(names) else str(joint)
    return {"cycle": k, "t": float(a.t[k]), "quantity": name, "joint": called, "by": float(y[k, joint] - x[k, joint])}


def _apart(a: Trace, b: Trace, pairs: Mapping[str, tuple[Array, Array]]) -> dict[str, dict[str, float]]:
    series = {name: pairs[name] for name in ("q", "qdot", "clearance") if name in pairs}
    count = min(len(a.records), len(b.records))
    if "margin" in pairs:
        shared = [name for name in a.header["constraints"] if name in b.header["constraints"]]
        series |= {f"margin {n}": (a.margin(n)[:count, None], b.margin(n)[:count, None]) for n in shared}
    out = {}
    for name, (x, y) in series.items():
        if x.shape == y.shape and len(x):
            away = np.abs(y - x).max(axis=1)
            rms = float(np.sqrt(np.mean((y - x) ** 2)))
            out[name] = {"max": float(away.max()), "at_cycle": int(np.argmax(away)), "rms": rms}
    return out


def summary_of(trace: Trace) -> dict[str, Any]:
    """The figures of merit of a trace, whatever kind of scene it comes from."""
    from scenarios.anatomy.parts import build_parts
    from scenarios.resolved import resolved_scene

    scene = resolved_scene(trace)
    if isinstance(scene, Scene):
        from scenarios.analysis.kept import kept_summary

        if trace.header["kind"] == BY_HAND:
            from scenarios.by_hand.metrics import summary
        else:
            from scenarios.analysis.metrics import summary

        return summary(trace) | kept_summary(trace, scene, build_parts(scene.anatomy))
    from scenarios.analysis.hands_on_metrics import summary as hands_on_summary

    return hands_on_summary(trace, scene, build_parts(scene.anatomy, scene.port))


def _metrics(a: Trace, b: Trace) -> dict[str, tuple[Any, Any]]:
    """Figures of merit that differ; those that only repeat the header, and the times, are left out."""
    x, y = (flat(summary_of(trace)) for trace in (a, b))
    known = {*a.header, *b.header}
    return {
        key: (x.get(key), y.get(key))
        for key in {**x, **y}
        if x.get(key) != y.get(key) and key.split(".")[0] not in {*known, *UNTOLD, "events", "integrator"}
    }
