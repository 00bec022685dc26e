"""Independent judges of paths, written without the solver's code: for tests and benchmarks."""
