"""Measured vibration: files and a rig file in; a spectrum with covariance, clean records and findings out.

    from rotorstudy import read_measurement

Inside the package all is in the project's convention: z = x + j y with x along gravity and y where x turns to, angles
in rad, time zero when the shaft's reference line points along x. What a file has instead is said in the section
`measurement:` of the rig file (docs/measured_records.md) and undone on reading.
"""
