"""Figures, tables and pages, made from data."""
