"""The vessel and what rides on it: simulator, PID, node reporter, contacts, obstacles, referees."""
