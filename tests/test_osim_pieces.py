"""Functions of OpenSim as polynomials in pieces, and their inverses."""

import numpy as np

from mjwrap.osim.description.functions import Piecewise, linear
from mjwrap.osim.writing.quartics import inverse_pieces, quartic_pieces


def test_functions_of_higher_degree_become_smooth_quartics():
    rng = np.random.default_rng(0)
    for _ in range(50):
        breaks = np.sort(rng.uniform(-1.0, 1.0, 3))
        function = Piecewise(
            breaks, rng.uniform(-1.0, 1.0, 4), rng.normal(size=(4, 10)) * 0.4 ** np.arange(10)
        )
        pieces = quartic_pieces(function, -1.5, 1.5)
        assert pieces.coefficients.shape[1] <= 5
        x = rng.uniform(-1.5, 1.5, 500)
        np.testing.assert_allclose(pieces(x), function(x), rtol=0.0, atol=1.5e-10)
        new = np.setdiff1d(pieces.breaks, breaks)
        below, above = pieces(new - 1e-9, 1), pieces(new + 1e-9, 1)
        np.testing.assert_allclose(below, above, rtol=0.0, atol=1e-5)


def test_inverses_of_functions():
    rng = np.random.default_rng(1)
    x = np.linspace(-1.0, 1.0, 301)
    for sign in (1.0, -1.0):
        for _ in range(25):
            rows = np.array([[0.0, 1.0, 0.2, -0.1]]) * sign + np.array(
                [[0.0, 0.0, 0.05, 0.05]]
            ) * rng.uniform(-1, 1, 4)
            function = Piecewise(np.zeros(0), np.zeros(1), rows)
            inverse = inverse_pieces(function, -1.0, 1.0)
            assert inverse is not None
            np.testing.assert_allclose(inverse(function(x)), x, rtol=0.0, atol=1.2e-10)
            outer = Piecewise(np.array([0.1]), np.zeros(2), rng.normal(size=(2, 4)))
            both = inverse_pieces(function, -1.0, 1.0, outer=outer)
            assert both is not None
            inner = x[np.abs(x - 0.1) > 1e-6]
            np.testing.assert_allclose(both(function(inner)), outer(inner), rtol=0.0, atol=1.2e-10)
    assert inverse_pieces(Piecewise(np.zeros(0), np.zeros(1), np.array([[0.0, 0.0, 1.0]])), -1.0, 1.0) is None
    steep = inverse_pieces(linear(-2.0, 1.0), -1.0, 1.0)
    assert steep is not None
    assert steep(5.0) == -2.0
