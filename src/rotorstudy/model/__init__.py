"""The model: effects as tables of entries, the structure they act on, rig files, and the registry of plugins."""
