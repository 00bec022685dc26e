"""The tangency conditions of a span: path error, its Jacobian, Newton's method, certificate."""
