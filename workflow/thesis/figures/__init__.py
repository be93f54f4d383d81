"""Figures of Chapters 2 to 6."""
