"""Further machines of the independent simulator (rotorstudy.blind.machines), which benchmarks and tests use by name."""
