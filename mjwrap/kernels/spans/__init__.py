"""Spans and chains: which obstacles are touched, on which side, and how a path follows moving bodies."""
