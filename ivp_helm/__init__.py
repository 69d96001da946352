"""The interval-programming helm: objective functions, solver, behaviour files, modes and the helm itself."""

from pymoos_lite.compiled import install

# Before any other module of ours is imported, else its plain form is.
install()
