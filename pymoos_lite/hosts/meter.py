"""What the process costs: processor load and memory, where the system can tell."""

from __future__ import annotations

import sys
import time

PERIOD = 0.5
"""Wall seconds between two measurements: at a high time warp many apps ask many times."""


class ProcessMeter:
    """Load and memory of this process; zeros for what the platform does not say."""

    def __init__(self) -> None:
        self._cpu = time.process_time()
        self._load_at = self._memory_at = time.monotonic()
        self._load = 0.0
        self._memory = self._measured_memory()

    def cpu_load(self) -> float:
        """Percent of one core, over at least the last half second."""
        wall = time.monotonic()
        if wall - self._load_at >= PERIOD:
            cpu = time.process_time()
            self._load = 100.0 * (cpu - self._cpu) / (wall - self._load_at)
            self._load_at, self._cpu = wall, cpu
        return self._load

    def memory_kb(self) -> tuple[int, int]:
        """Resident memory (highest so far, where the present one is not known) in kilobytes, twice."""
        wall = time.monotonic()
        if wall - self._memory_at >= PERIOD:
            self._memory_at, self._memory = wall, self._measured_memory()
        return self._memory

    def _measured_memory(self) -> tuple[int, int]:
        try:
            import resource
        except ImportError:  # Windows
            return 0, 0
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        if sys.platform == "darwin":  # bytes there, kilobytes elsewhere
            peak //= 1024
        return int(peak), int(peak)
