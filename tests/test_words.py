"""Tables of text, and error messages for invalid numbers."""

import numpy as np
import pytest

import mjwrap as mw
from mjwrap import validation
from mjwrap.text import aligned


def test_columns_of_text_are_aligned_and_nothing_is_cut() -> None:
    long = "x" * 200
    assert aligned([("muscle", "l [m]", ""), ("a", "0.25", long), ("BIClong", "1", "")], (0, 2)) == [
        "muscle   l [m]",
        f"a         0.25  {long}",
        "BIClong      1",
    ]
    assert aligned([]) == []


@pytest.mark.parametrize("value", [0.0, -1.0, np.nan, np.inf, "1", None, (1.0, 2.0)])
def test_a_number_that_is_not_finite_and_positive_is_told(value: object) -> None:
    with pytest.raises(mw.GeometryError) as caught:
        validation.positive(value, "Sphere: radius", mw.GeometryError, "m")
    assert str(caught.value) == f"Sphere: radius must be finite and positive [m], not {value!r}"
    assert not validation.is_positive(value)


def test_numbers_that_can_be_used_are_returned_as_floats() -> None:
    found = validation.positive(np.int64(2), "n", mw.ModelError)
    assert (found, type(found)) == (2.0, float)
    assert validation.positive(np.inf, "half_length", mw.GeometryError, unbounded=True) == np.inf
    assert validation.not_negative(0, "damping", mw.ModelError) == 0.0
    for value in (-1e-9, np.inf, np.nan):
        with pytest.raises(mw.ModelError, match="damping must be finite and >= 0, not"):
            validation.not_negative(value, "damping", mw.ModelError)
