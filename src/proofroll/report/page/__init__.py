"""HTML page of a report: its records, sentences and templates."""
