"""The GCID paper's mission: find blooms, sample them, and flee from storms, as a fleet chooses."""
