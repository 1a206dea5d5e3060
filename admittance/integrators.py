"""One period of the target dynamics, from one configuration that is evaluated to the next.

An integrator is a function of its phase: it leaves in Q_TRIAL a configuration to be evaluated and returns the phase in
which to go on from there, or DONE where Q stands as it was evaluated last. So evaluating, by far the longest piece of
code, stands once in the cycle.
"""

import numpy as np

from admittance.memory import Whole
from admittance.outcome import Form, Integrator, Option
from admittance.robust import robust
from admittance.runge_kutta import runge_kutta
from admittance.steps import BACK, DONE, KEEP, euler, full_step, keep, semi_implicit
from primitives.checks import Array
from primitives.compiled import compiled
from primitives.memory import MEMORY, integers


@compiled(f"int64({MEMORY}, float64[:,::1], int64, int64)")
def advance(f: Array, fl: np.ndarray, w: np.ndarray, wl: np.ndarray, near: Array, phase: int, blocked: int) -> int:
    """Go on from a phase by the chosen form and integrator; blocked is what `model.evaluate` returned before."""
    options = integers(w, wl, Whole.OPTIONS)
    integrator = options[Option.INTEGRATOR]
    if phase == BACK:
        return DONE
    if integrator == Integrator.RK4:
        return runge_kutta(f, fl, w, wl, phase, blocked)
    if integrator == Integrator.ROBUST:
        return robust(f, fl, w, wl, near, phase, blocked)
    if phase == KEEP:
        return keep(f, fl, w, wl, blocked)
    if options[Option.FORM] != Form.REDUCED:
        return full_step(f, fl, w, wl)
    return euler(f, fl, w, wl) if integrator == Integrator.EULER else semi_implicit(f, fl, w, wl)
