"""Importers of robot files that engines bring, as readers that can be checked."""
