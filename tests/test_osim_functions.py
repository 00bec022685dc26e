"""Every function of an .osim file as piecewise polynomials: values, slopes, ends, and what is refused."""

import numpy as np
import pytest
from osim_frozen import frozen

import mjwrap as mw
from mjwrap.osim.reading.document import parse
from mjwrap.osim.reading.functions import read_function
from mjwrap.osim.reading.nodes import Document
from mjwrap.osim.reading.splines import natural_spline


def function(text: str):
    return read_function(parse(text, Document("test.osim")))


def knots(x, y) -> str:
    return f"<x>{' '.join(map(repr, x))}</x><y>{' '.join(map(repr, y))}</y>"


@pytest.mark.parametrize(
    "record", frozen("splines.json"), ids=lambda record: f"{record['kind']}-{len(record['x'])}"
)
def test_splines_are_those_of_opensim(record):
    kind = record["kind"]
    order = "<half_order>2</half_order>" if kind == "GCVSpline" else ""
    ours = function(f"<{kind}>{order}{knots(record['x'], record['y'])}</{kind}>")
    # OpenSim solves for natural splines less exactly than for SIMM's
    tolerance = 1e-14 if kind == "SimmSpline" else 2e-13
    for derivative, name in ((0, "values"), (1, "slopes")):
        wanted = np.array(record[name])
        error = np.abs(ours(record["at"], derivative) - wanted) / np.maximum(1.0, np.abs(wanted).max())
        assert error.max() < tolerance


@pytest.mark.parametrize("count", [4, 5, 9])
def test_simm_spline_has_no_jumps_and_the_third_derivative_of_its_end_cubics(count):
    rng = np.random.default_rng(count)
    x = np.sort(rng.uniform(-2.0, 2.0, count))
    y = rng.normal(size=count)
    spline = function(f"<SimmSpline>{knots(x.tolist(), y.tolist())}</SimmSpline>")
    for derivative in range(3):
        inner = x[1:-1]
        step = inner - spline.origins[1:-2]
        below = [taylor(spline.coefficients[i + 1], step[i], derivative) for i in range(count - 2)]
        np.testing.assert_allclose(spline(inner, derivative), below, atol=1e-10)
    for side, piece in ((slice(0, 4), 1), (slice(-4, None), -2)):
        cubic = np.polyfit(x[side] - x[side][0], y[side], 3)[0]
        assert spline.coefficients[piece, 3] == pytest.approx(cubic, rel=1e-8)


def taylor(coefficients, step, derivative):
    polynomial = np.polynomial.Polynomial(coefficients)
    return (polynomial.deriv(derivative) if derivative else polynomial)(step)


@pytest.mark.parametrize("half_order", [1, 2, 3, 4])
def test_natural_splines_pass_their_knots_smoothly_and_end_as_polynomials(half_order):
    rng = np.random.default_rng(half_order)
    x = np.cumsum(rng.uniform(0.2, 0.5, 11))
    y = rng.normal(size=11)
    spline = natural_spline(x, y, half_order)
    np.testing.assert_allclose(spline(x), y, atol=1e-12)
    assert not spline.coefficients[[0, -1], half_order:].any()
    for derivative in range(2 * half_order - 1):
        below = [taylor(spline.coefficients[i], x[i] - spline.origins[i], derivative) for i in range(11)]
        scale = 1.0 + np.abs(below).max()
        np.testing.assert_allclose(spline(x, derivative) / scale, np.array(below) / scale, atol=1e-9)


X = np.array([-3.0, -1.0, -0.5, 0.0, 0.3, 1.0, 2.0, 4.0])


@pytest.mark.parametrize(
    ("text", "wanted"),
    [
        ("<Constant><value>2.5</value></Constant>", np.full(8, 2.5)),
        ("<LinearFunction><coefficients>2 -1</coefficients></LinearFunction>", 2.0 * X - 1.0),
        ("<PolynomialFunction><coefficients>1 2 3</coefficients></PolynomialFunction>", X**2 + 2.0 * X + 3.0),
        (
            "<PiecewiseLinearFunction><x>-1 0 2</x><y>0 1 -3</y></PiecewiseLinearFunction>",
            np.where(X < 0.0, 1.0 + X, 1.0 - 2.0 * X),
        ),
        (
            "<PiecewiseConstantFunction><x>-1 0 2</x><y>4 1 -3</y></PiecewiseConstantFunction>",
            np.select([X < 0.0, X < 2.0], [4.0, 1.0], -3.0),
        ),
        (
            "<StepFunction><transition_start_time>0</transition_start_time><transition_end_time>2</transition_end_time>"
            "<start_value>1</start_value><end_value>3</end_value></StepFunction>",
            1.0 + 2.0 * np.polyval([6.0, -15.0, 10.0, 0.0, 0.0, 0.0], np.clip(X / 2.0, 0.0, 1.0)),
        ),
        (
            "<MultiplierFunction><function><MultiplierFunction><function><LinearFunction>"
            "<coefficients>1 1</coefficients></LinearFunction></function><scale>3</scale>"
            "</MultiplierFunction></function><scale>-2</scale></MultiplierFunction>",
            -6.0 * (X + 1.0),
        ),
        (
            "<Sine><amplitude>2</amplitude><omega>3</omega><phase>0.4</phase><offset>0.1</offset></Sine>",
            2.0 * np.sin(3.0 * X + 0.4) + 0.1,
        ),
    ],
    ids=lambda value: value[1 : value.index(">")] if isinstance(value, str) else "",
)
def test_functions_follow_their_formula(text, wanted):
    ours = function(text)
    np.testing.assert_allclose(ours(X), wanted, atol=1e-12)
    assert ours.error < 1e-12


def test_a_sine_states_its_error():
    ours = function("<Sine><amplitude>2</amplitude><omega>3</omega></Sine>")
    x = np.linspace(-10.0, 10.0, 4001)
    assert 0.0 < np.abs(ours(x) - 2.0 * np.sin(3.0 * x)).max() < ours.error < 1e-12


@pytest.mark.parametrize(
    ("text", "told"),
    [
        (
            "<MultivariatePolynomialFunction/>",
            "functions of class MultivariatePolynomialFunction cannot be read; classes: Con",
        ),
        ("<LinearFunction><coefficients>1 2 3</coefficients></LinearFunction>", "has 3 coefficients"),
        ("<SimmSpline><x>0 1</x><y>0</y></SimmSpline>", "has 2 values of x and 1 of y"),
        ("<SimmSpline><x>0</x><y>0</y></SimmSpline>", "has 1 points; at least 2"),
        ("<SimmSpline><x>0 0</x><y>0 1</y></SimmSpline>", "values of x must be ascending"),
        ("<SimmSpline><x>0 one</x><y>0 1</y></SimmSpline>", "'one' is not a number"),
        ("<SimmSpline><x>0 1_0</x><y>0 1</y></SimmSpline>", "'1_0' is not a number"),
        ("<SimmSpline><x>0 nan</x><y>0 1</y></SimmSpline>", "must be a finite number, not nan"),
        ("<GCVSpline><half_order>2</half_order><x>0 1 2</x><y>0 1 2</y></GCVSpline>", "needs at least 4"),
        (
            "<GCVSpline><half_order>9</half_order><x>0 1 2</x><y>0 1 2</y></GCVSpline>",
            "half_order must be 1, 2, 3 or 4",
        ),
        (
            "<GCVSpline><half_order>1</half_order><error_variance>1</error_variance><x>0 1</x><y>0 1</y></GCVSpline>",
            "error_variance is not 0",
        ),
        (
            "<MultiplierFunction><scale>2</scale></MultiplierFunction>",
            "the function that it multiplies is missing",
        ),
        ("<Sine><omega>1e9</omega></Sine>", "omega = 1e\\+09 is too fast"),
        (
            "<StepFunction><transition_start_time>3</transition_start_time></StepFunction>",
            "must be after its start",
        ),
    ],
)
def test_functions_that_cannot_be_read_say_why(text, told):
    with pytest.raises(mw.OsimError, match=told):
        function(text)
