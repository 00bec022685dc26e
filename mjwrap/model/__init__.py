"""Prepare a compiled model: the kernels' arrays, disabled actuators, coupled joints, and crossed dofs."""
