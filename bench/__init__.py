"""Measurements of clpt, a module for each question; `python -m bench` runs them all.

traversal: rays against Embree; builders: how fast trees are made; renders: pictures against
Mitsuba's; starting: whole processes, cold and warm, and their memory; compiling: what light paths
and photons add to it; house: how long and tangled the code is. Records go to bench/results as JSON
lines; bench.report makes a page of them.
"""
