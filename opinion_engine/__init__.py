"""Nonlinear opinion dynamics: how a fleet chooses together what each vessel then does.

Read in this order: `model` (the equation, its kernels in `kernels`), `theory` and `analysis` (what it must do),
`option_file`, `messages`, `neighbours` and `engine` (one agent), `app` and `marker` (the apps), `activation` (from
options to behaviours), `graphs` and `population` (many agents; what a run leaves in `recording`), `reach`, `traps` and
`design` (what an option file will do), `studies` and `plots` (figures; the commands are in `opinion_tool`).
"""

from pymoos_lite.compiled import install

# Before any other module of ours is imported, else its plain form is.
install()
