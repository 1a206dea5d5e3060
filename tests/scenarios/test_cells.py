"""Cells of a comparison: what is better at what, on results made up so that the answer is known."""

import numpy as np
import pytest

from scenarios.analysis import report_table
from scenarios.analysis.cells import difference, gather
from scenarios.analysis.measures import OF_HANDS_ON

BY_KEY = {m.key: m for m in OF_HANDS_ON}


def result(enforcement, seed, *, robot="lwr4plus", guard="watch", slipped=False, **values):
    """One run in which only the named values are other than 1."""
    out = {
        "kind": "hands-on",
        "robot": robot,
        "enforcement": enforcement,
        "guard": guard,
        "seed": seed,
        "slipped": slipped,
    }
    for measure in OF_HANDS_ON:
        place, *inner = measure.key.split(".")
        value = values.get(place, 1.0)
        if inner:
            out.setdefault(place, {})[inner[0]] = value
        else:
            out[place] = value
    return out


def runs(enforcement, count=8, spread=0.0, **values):
    rng = np.random.default_rng(len(enforcement))
    return [
        result(
            enforcement, s, **{k: v + spread * rng.normal() if isinstance(v, float) else v for k, v in values.items()}
        )
        for s in range(count)
    ]


def test_better_is_the_cell_that_beats_every_other_with_a_boundary():
    cells = gather(
        [
            *runs("none", hand_work_J=0.1),
            *runs("admittance", hand_work_J=3.0, tangential_freedom=0.5),
            *runs("vfi", hand_work_J=2.0, tangential_freedom=0.9),
            *runs("both", hand_work_J=3.0, tangential_freedom=0.5),
        ]
    )
    assert [c.name for c in cells] == ["none", "admittance", "vfi", "both"]
    assert [c.better for c in cells] == [set(), set(), {"hand_work_J", "tangential_freedom"}, set()]


def test_no_mark_where_the_interval_holds_zero_or_runs_are_few():
    noisy = [*runs("vfi", spread=1.0, hand_work_J=2.0), *runs("both", spread=1.0, hand_work_J=2.05)]
    assert not any(c.better for c in gather(noisy))
    few = [*runs("vfi", 5, hand_work_J=2.0), *runs("both", 5, hand_work_J=9.0)]
    assert not any(c.better for c in gather(few))
    enough = [*runs("vfi", 6, hand_work_J=2.0), *runs("both", 6, hand_work_J=9.0)]
    assert [c.better for c in gather(enough)] == [{"hand_work_J"}, set()]


def test_a_cell_that_slipped_is_not_compared_in_effort_and_is_in_the_rest():
    slipping = runs("vfi", hand_work_J=1.0, penetration_depth_m=0.0)
    slipping[3]["slipped"] = True
    cells = gather([*slipping, *runs("both", hand_work_J=2.0), *runs("admittance", hand_work_J=3.0)])
    assert "hand_work_J" not in cells[0].better and "penetration_depth_m" in cells[0].better
    assert "hand_work_J" in cells[1].better, "the others are compared with each other"
    assert difference(BY_KEY["hand_work_J"], cells[0], cells[1]) is None
    rows = {row.label: row for row in report_table.rows(cells)}
    assert rows["work of the hand"].entries[0].void and not rows["work of the hand"].entries[1].void
    assert not rows["penetration"].entries[0].void
    assert rows["runs that slipped off it"].entries[0].text == "1 of 8"
    (note,) = report_table.notes(cells)
    assert "vfi: 1 of 8" in note


def test_the_worst_run_counts_where_safety_is_at_stake():
    some = runs("vfi", clearance_m=0.003)
    some[5]["clearance_m"]["between_samples"] = -0.001
    (cell,) = gather(some)
    assert cell.worst(BY_KEY["clearance_m.between_samples"]) == -0.001
    row = next(r for r in report_table.rows([cell]) if r.label == "smallest clearance")
    assert row.entries[0].alarm and row.entries[0].text == "\N{MINUS SIGN}1"


def test_guards_and_arms_are_cells_of_their_own():
    results = [r for guard in ("watch", "act") for r in runs("vfi", guard=guard)]
    results += runs("vfi", robot="neuro8", guard="act")
    assert [(c.robot, c.name) for c in gather(results)] == [
        ("lwr4plus", "guard watches"),
        ("lwr4plus", "guard acts"),
        ("neuro8", "guard acts"),
    ]
    assert [c.name for c in gather([*results, *runs("both")])][1:] == [
        "vfi, guard acts",
        "vfi, guard acts",
        "both, guard watches",
    ]
    assert [c.name for c in gather(runs("vfi"))] == ["vfi"]


def test_runs_with_other_seeds_are_not_paired():
    cells = gather([*runs("vfi"), *runs("both", 7)])
    assert difference(BY_KEY["hand_work_J"], *cells) is None


def test_a_measure_that_some_run_has_not_is_left_out():
    some = runs("vfi", felt_clearance_m=0.001)
    some[2]["felt_clearance_m"] = None
    (cell,) = gather(some)
    assert cell.interval(BY_KEY["felt_clearance_m"]) is None


@pytest.mark.parametrize(
    ("value", "text"),
    [
        (0.0, "0"),
        (1.23456, "1.23"),
        (-0.0069, "\N{MINUS SIGN}0.0069"),
        (4.8e-14, "4.8e\N{MINUS SIGN}14"),
        (1234.6, "1235"),
    ],
)
def test_numbers_are_shown_to_three_digits(value, text):
    assert report_table.shown(value) == text
