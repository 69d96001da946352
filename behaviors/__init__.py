"""The behaviours that come with pymoos-lite, one file each."""

import pymoos_lite  # noqa: F401  (lets imports find compiled modules)
