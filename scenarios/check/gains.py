"""Gains times the period: above 1 a step oversteps what it approaches, and a controller refuses to be built."""

from collections.abc import Sequence
from typing import NamedTuple

from scenarios.check.finding import Finding, Part, Severity

CHECK = "gains"
REFUSED, HIGH, WITH_POTENTIALS = 1.0, 0.5, 0.25
"""Of eta T: not accepted above; uses up half a margin in one period; the most for rows beside potentials."""
ROUNDING = 1e-12


class Gain(NamedTuple):
    """A gain of a scene, 1/s: of a constraint, of the joint limits, of the port or of the task."""

    where: str
    kind: str
    value: float


def check_gains(gains: Sequence[Gain], period: float) -> Part:
    """Every gain times the period T, seconds."""
    rows, findings = [], []
    for gain in gains:
        product = gain.value * period
        rows.append({"name": gain.where, "kind": gain.kind, "gain_per_s": gain.value, "gain_T": product})
        numbers = {"gain_per_s": gain.value, "gain_T": product}
        said = f"{gain.kind} T = {product:.3g} ({gain.kind} = {gain.value:g} 1/s, T = {period * 1e3:g} ms)"
        if product > REFUSED + ROUNDING:
            advice = f"take {gain.kind} <= {REFUSED / period:g} 1/s, or a period <= {REFUSED / gain.value * 1e3:g} ms"
            findings.append(Finding(Severity.ERROR, CHECK, gain.where, f"{said}: above 1 is refused", advice, numbers))
        elif product > HIGH and gain.kind == "eta":
            what = f"{said}: a period may use up that share of the margin"
            advice = (
                f"{WITH_POTENTIALS / period:g} 1/s would use up a quarter, which rows beside potentials should keep"
            )
            findings.append(Finding(Severity.NOTE, CHECK, gain.where, what, advice, numbers))
    return Part(CHECK, rows, findings)
