"""Preflight calibration: the worker that runs one at a time, and one file for each."""
