"""What a compiled model gives to mjwrap: the kernels' flat arrays, and which native actuators are taken over."""
