"""Apps that any community uses: logger, process watch, timer script, echo."""
