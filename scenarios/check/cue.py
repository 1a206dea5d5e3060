"""What the hand feels before a boundary: where the potential begins, and where it balances the hand."""

import numpy as np
from scipy.optimize import brentq

from admittance.parameters import Parameters
from admittance.potential import barrier
from scenarios.check.finding import Finding, Part, Severity, amount
from scenarios.check.hand import Speeds
from scenarios.check.space import Space

CHECK = "cue"
JUMPED = 0.25
"""Share of the potential's range that may be moved in a period before that is said."""
STABLE = 2.0
"""T D / M from which damping that is taken at the old velocity makes it grow."""


def balance(parameters: Parameters, force: float) -> float:
    """Clearance from one cloud point, metres, at which its repulsion is a force, N; 0 where no force is felt."""
    if parameters.k == 0.0 or force <= 0.0:
        return 0.0
    least = 1e-12 * parameters.d_0
    return float(brentq(lambda c: barrier(c, parameters.k, parameters.d_0, 0.0)[1] - force, least, parameters.d_0))


def check_cue(
    space: Space, parameters: Parameters, integrator: str, period: float, force: float, speeds: Speeds
) -> Part:
    """The potential against the hand's largest force, N, and the damping against the period, seconds."""
    rest = balance(parameters, force)
    way = speeds.reachable * period
    rows = [
        {
            "name": c.name,
            "range_m": parameters.d_0,
            "force_N": force,
            "balanced_m": rest,
            "way_per_period_m": way,
        }
        for c in space.constraints
        if c.is_cloud
    ]
    findings = []
    if rows and parameters.k > 0.0 and integrator != "robust" and way > JUMPED * parameters.d_0:
        what = (
            f"under {force:.3g} N the shaft can move {amount(way, 'm')} in a period, {way / parameters.d_0:.0%} of the "
            f"potential's range of {amount(parameters.d_0, 'm')}: potentials alone may be jumped"
        )
        advice = 'enforce by "vfi" or "both", or take the integrator "robust" or a shorter period'
        numbers = {"way_per_period_m": way, "range_m": parameters.d_0}
        findings.append(Finding(Severity.NOTE, CHECK, "potential", what, advice, numbers))
    damping = np.array(parameters.D_c) + parameters.Q + parameters.G
    share = float((period * damping / np.array(parameters.inertia)).max())
    if not parameters.implicit_damping and share > 1.0:
        severity = Severity.ERROR if share > STABLE else Severity.WARNING
        what = f"T D / M is up to {share:.3g}: damping at the old velocity turns the motion round; above 2 it grows"
        advice = "set implicit_damping, or take a shorter period, less damping or more inertia"
        findings.append(Finding(severity, CHECK, "damping", what, advice, {"T_D_over_M": share}))
    return Part(CHECK, rows, findings)
