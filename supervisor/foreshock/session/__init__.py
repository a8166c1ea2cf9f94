"""Runs: a twin and a supervisor together, in this process or a watched one."""
