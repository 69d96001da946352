"""Missions that ship with pymoos-lite; each folder is an example, a regression test and a page of manual."""
