"""Messages: arrays with names that behave like the mappings they are."""

import copy
from collections.abc import Mapping

import numpy as np
import pytest

from primitives.errors import UnknownNameError
from vfi.messages import ByName, Measurement, Rows


@pytest.fixture
def by_name() -> ByName:
    return ByName({"C1": 0, "floor": 1, "axis": 2}, np.array([0.5, -0.25, 0.0]))


def test_is_a_mapping(by_name):
    assert isinstance(by_name, Mapping)
    assert dict(by_name) == {"C1": 0.5, "floor": -0.25, "axis": 0.0}
    assert list(by_name) == ["C1", "floor", "axis"] and len(by_name) == 3
    assert list(by_name.values()) == [0.5, -0.25, 0.0] and list(by_name.items())[1] == ("floor", -0.25)
    assert by_name == {"C1": 0.5, "floor": -0.25, "axis": 0.0} != {"C1": 0.5}
    assert isinstance(by_name["C1"], float) and type(by_name["C1"]) is float


def test_names_that_are_not_there(by_name):
    """`in` and `get` answer as for any mapping; `[]` says what there is."""
    assert "C1" in by_name and "C2" not in by_name and 7 not in by_name and None not in by_name
    assert by_name.get("floor") == -0.25 and by_name.get("flor") is None and by_name.get("flor", 3.0) == 3.0
    with pytest.raises(UnknownNameError, match=r'unknown constraint "flor"\. Did you mean "floor"'):
        by_name["flor"]


def test_as_an_array(by_name):
    np.testing.assert_array_equal(np.asarray(by_name), [0.5, -0.25, 0.0])
    assert np.asarray(by_name, dtype=np.float32).dtype == np.float32
    assert np.array(by_name).min() == -0.25 and by_name.array.shape == (3,)


def test_is_shown_by_name(by_name):
    assert repr(by_name) == "ByName({'C1': 0.5, 'floor': -0.25, 'axis': 0.0})"


def test_copies(by_name):
    assert dict(copy.copy(by_name)) == dict(copy.deepcopy(by_name)) == dict(by_name)


def test_empty():
    empty = ByName({}, np.empty(0))
    assert not empty and dict(empty) == {} and "C1" not in empty
    with pytest.raises(UnknownNameError, match="none are declared"):
        empty["C1"]


def test_what_may_be_left_out():
    m = Measurement(0.0, np.zeros(2), np.zeros(2))
    assert m.wrench is None and m.entities is None and m.stamps is None
    assert Rows(np.eye(2), np.zeros(2))[2:] == (1.0, 0.0)
