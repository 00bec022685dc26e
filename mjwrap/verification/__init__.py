"""Independent tests of paths, without the solver's code, for tests and benchmarks."""
