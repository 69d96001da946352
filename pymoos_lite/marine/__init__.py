"""Vessel simulator, PID, node reporter, contact and obstacle managers."""
