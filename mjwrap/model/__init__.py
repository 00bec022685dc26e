"""What mjwrap makes of a compiled model: the kernels' arrays, disabled actuators, coupled joints, crossed dofs."""
