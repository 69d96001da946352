"""Interval programming on its own: domains, piecewise functions, builders, an exact solver."""
