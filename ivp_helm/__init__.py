"""The interval-programming helm: objective functions, solver, behaviour files, modes and the helm itself."""
