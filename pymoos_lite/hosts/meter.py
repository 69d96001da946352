"""What the process costs: processor load and memory, where the system can tell."""

from __future__ import annotations

import sys
import time


class ProcessMeter:
    """Load and memory of this process; zeros for what the platform does not say."""

    def __init__(self) -> None:
        self._cpu = time.process_time()
        self._wall = time.monotonic()
        self._load = 0.0

    def cpu_load(self) -> float:
        """Percent of one core, over at least the last half second."""
        wall, cpu = time.monotonic(), time.process_time()
        if wall - self._wall >= 0.5:
            self._load = 100.0 * (cpu - self._cpu) / (wall - self._wall)
            self._wall, self._cpu = wall, cpu
        return self._load

    def memory_kb(self) -> tuple[int, int]:
        """Resident memory (highest so far, where the present one is not known) in kilobytes, twice."""
        try:
            import resource
        except ImportError:  # Windows
            return 0, 0
        peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
        if sys.platform == "darwin":  # bytes there, kilobytes elsewhere
            peak //= 1024
        return int(peak), int(peak)
