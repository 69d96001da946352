"""Settings of all tests."""

import os
from pathlib import Path

import pymoos_lite

# Processes that tests start in other folders run the code under test, installed or not.
_root = str(Path(pymoos_lite.__file__).parents[1])
os.environ["PYTHONPATH"] = os.pathsep.join([_root, *filter(None, [os.environ.get("PYTHONPATH")])])
