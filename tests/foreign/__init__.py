"""An independent rotor simulator: records whose cause is known, from physics alone.

It shares no code with the package it is meant to test (`test_independence.py` holds it to that). Nodes count from 0
here and from 1 in the files written. Each node has four degrees of freedom x, y, a, b: displacements (m) and rotations
about the x and y axis (rad), right-handed with the spin from x to y. Gravity points along x.
"""
