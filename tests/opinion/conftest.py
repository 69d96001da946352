"""Kernels compile in the middle of the first example, so examples have no deadline."""

from hypothesis import settings

settings.register_profile("compiling", deadline=None)
settings.load_profile("compiling")
