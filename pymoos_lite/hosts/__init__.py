"""Hosts run apps: in real time over UDP, or in lockstep under virtual time."""
