"""A study of a mission that takes no time: each vessel throws dice, the shoreside counts."""

import textwrap

PLUGIN = '''
import os
import time

from pymoos_lite.app import App
from pymoos_lite.config.parameters import Declaration, Parameter


class Dice(App):
    """Posts a draw of the run's seed; with a file named in `trap`, dies at its first sight of it."""

    MOOS_NAME = "pDice"
    DEFAULT_TICK = 1.0
    PARAMETERS = Declaration(
        (
            Parameter("bonus", "number", 0.0),
            Parameter("trap", "text", ""),
            Parameter("fail", "text", ""),
            Parameter("nap", "number", 0.0),
        )
    )

    def iterate(self):
        time.sleep(self.config.nap)
        if self.config.trap and os.path.exists(self.config.trap):
            os.remove(self.config.trap)
            os._exit(9)
        if self.config.fail == self.community:
            raise RuntimeError("the dice rolled off the table")
        self.notify("DRAW", self.random.random() + self.config.bonus)
        self.notify("THROWS", float(self.iteration))
        self.notify("LUCKY", "true")
'''

FLEET = """
fleet: dice
seed: 1
macros: {BONUS: 0, TRAP: "", FAIL: "", NAP: 0}
shoreside: {moos: shore.moos}
vehicles:
  count: 2
  moos: vehicle.moos
  start: {area: {x: [0, 100], y: [0, 100]}, separation: 5}
presets:
  plain: {}
  loaded: {macros: {BONUS: 1}}
"""

MOOS = """
ServerHost = localhost
ServerPort = $(MOOS_PORT)
Community = $(VNAME)
ProcessConfig = ANTLER
{
  Run = MOOSDB
  Run = pDice
}
ProcessConfig = pDice
{
  bonus = $(BONUS)
  trap  = $(TRAP)
  fail  = $(FAIL)
  nap   = $(NAP)
}
"""

STUDY = """
study: dice
mission: mission
duration: 5
seeds: {first: 1, count: 4}
grid:
  vehicles: [1, 2]
  method: [plain, loaded]
measure:
  total: sum DRAW
  mean: mean DRAW
  least: min DRAW
  most: max DRAW
  throws: shoreside THROWS
  lucky: shoreside LUCKY
  none: shoreside NEVER_POSTED
  zero: shoreside NEVER_POSTED or 0
  sent: network datagrams
derive:
  each: total / vehicles
  nothing: 1 / zero
compare:
  - {column: each, factor: method, pairs: [[loaded, plain]], within: [vehicles]}
"""


def write_study(folder, text=STUDY):
    """Write the mission and the study into `folder`; the study file."""
    mission = folder / "mission"
    mission.mkdir(parents=True, exist_ok=True)
    (mission / "dice.py").write_text(textwrap.dedent(PLUGIN))
    (mission / "fleet.yaml").write_text(FLEET)
    for name in ("shore.moos", "vehicle.moos"):
        (mission / name).write_text(MOOS)
    path = folder / "study.yaml"
    path.write_text(text)
    return path
