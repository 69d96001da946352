"""The interval-programming helm: objective functions, solver, behaviour files, modes and the helm itself."""

import pymoos_lite  # noqa: F401  (lets imports find compiled modules)
