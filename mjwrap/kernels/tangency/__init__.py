"""The tangency conditions of a span: residuals, their Jacobian, Newton's method, and the certificate of a solution."""
