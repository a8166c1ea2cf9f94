"""Twins that stand for the robot and its world: FMUs."""
