"""Nonlinear opinion dynamics: model, single-agent engine, theory and large populations."""
