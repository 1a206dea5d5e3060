"""The energy ledger of runs that a hand leads, as a figure."""

from collections.abc import Sequence

from primitives.checks import Array
from scenarios.analysis.curves import TIME, View
from scenarios.analysis.figures import thin
from scenarios.analysis.picture import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PURPLE,
    SKY,
    VERMILION,
    Chart,
    Line,
    Panel,
)
from scenarios.analysis.trace import Trace

POINTS = 300
TERMS = {
    "work of the hand": BLUE,
    "damping": VERMILION,
    "numerical": PURPLE,
    "rows that keep": ORANGE,
    "recovery and moving regions": GREY,
    "limits, port and guard": GREEN,
    "potentials in steps": SKY,
    "stored": BLACK,
}
"""Terms of the energy ledger and their colours. The stored energy is the sum of the others."""


def ledger_terms(trace: Trace) -> dict[str, Array]:
    """{term: (k,) J since the start}, by the names in `TERMS`."""
    rows, ports = trace.header["ports"], trace["ports"]
    keeping, recovering, moving = (ports[:, rows.index(name)] for name in ("keeping", "recovering", "moving"))
    return {
        "work of the hand": trace["hand"],
        "damping": -trace["dissipated"],
        "numerical": trace["numerical"],
        "rows that keep": keeping,
        "recovery and moving regions": recovering + moving + trace["clouds"],
        "limits, port and guard": trace["limited_work"] - keeping - recovering - moving,
        "potentials in steps": trace["barrier"],
        "stored": trace["storage"],
    }


def ledger(views: Sequence[View]) -> Chart:
    """Where the energy went, a panel for each run, all with the same axis."""
    panels, low, high = [], 0.0, 0.0
    for view in views:
        lines = []
        for label, y in ledger_terms(view.trace).items():
            keep = thin(y, POINTS)
            low, high = min(low, float(y.min())), max(high, float(y.max()))
            lines.append(Line(label, view.trace.t[keep], y[keep], TERMS[label]))
        panels.append((view.label, tuple(lines)))
    room = 0.06 * (high - low) or 1.0
    caption = (
        "What has entered and left the tool's motion since the start. The stored energy (kinetic and potential) "
        "is the sum of the others. Motion is passive as long as nothing but the hand, and what moves by itself, puts "
        "energy in: then no other term rises above zero."
    )
    return Chart(
        "ledger",
        "Energy ledger",
        caption,
        tuple(Panel(label, TIME, "energy [J]", lines, y_range=(low - room, high + room)) for label, lines in panels),
        columns=2,
        panel_height=230,
    )
