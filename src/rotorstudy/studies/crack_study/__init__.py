"""Chapter 7: how small a transverse crack is detected, and how accurately its place, depth and angle are found."""
