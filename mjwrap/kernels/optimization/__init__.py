"""Muscle activations that meet given moments: a bounded quadratic program for every frame.

problem.py      the groups of arrays: constraints, objective, results, work space
pattern.py      which muscles cross which joints
dual_newton.py  Newton's method on the dual problem, frame by frame
cholesky.py     the linear system of a Newton step; lu.py the same system where it is ill-conditioned
line_search.py  the length of a Newton step
optimality.py   how far a result is from optimal, for every frame
feasibility.py  which frames need reserves
"""
