"""Effects of which the search fits many shapes, which takes most of its time: tests about others leave them out.

The whole library is searched in test_report.py, test_findings.py, the blind tests, those against foreign machines and
the README's example.
"""

SLOW = ["breathing_crack", "cubic_stiffness", "looseness", "pedestal_resonance", "rub", "transverse_crack"]
