"""An independent rotor simulator: records whose cause is known, from physics alone.

It shares no code with what it is meant to test: a contract (`lint-imports`) and a test hold it to it. Nodes count from
0 here and from 1 in the files written. Each node has four degrees of freedom x, y, a, b: displacements (m) and
rotations about the x and y axis (rad), right-handed with the spin from x to y. Gravity points along x.
"""
