"""Settings of all tests."""

import os
from pathlib import Path

from hypothesis import settings

import pymoos_lite

# A run that passed passes again. To search further: HYPOTHESIS_PROFILE=searching pytest ...
settings.register_profile("repeatable", derandomize=True)
settings.register_profile("searching", max_examples=1000)
settings.load_profile(os.environ.get("HYPOTHESIS_PROFILE", "repeatable"))

# Processes that tests start in other folders run the code under test, installed or not.
_root = str(Path(pymoos_lite.__file__).parents[1])
os.environ["PYTHONPATH"] = os.pathsep.join([_root, *filter(None, [os.environ.get("PYTHONPATH")])])
