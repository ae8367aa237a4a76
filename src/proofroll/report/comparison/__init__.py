"""Comparison in a report: records, tables, curves and sentences."""
