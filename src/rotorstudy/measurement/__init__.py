"""Measured vibration: files and a rig file in; a spectrum with covariance, clean records and findings out.

    from rotorstudy import read_measurement

Inside the package one convention holds: z = x + j y with x along gravity and y a quarter revolution ahead of x in the
sense of rotation, angles in rad, time zero when the shaft's reference line points along x. The conventions of a file
are stated in the section `measurement:` of the rig file (docs/measured_records.md) and converted on reading.
"""
