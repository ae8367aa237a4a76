"""Check of robot files: what each engine's importer makes of them, and the causes of differences."""
