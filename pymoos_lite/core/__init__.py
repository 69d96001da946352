"""Cores without I/O: message, clock, subscriptions, database, frames and reliable link."""
