"""Our own engine adapters; each follows :class:`proofroll.engine.Engine` and is found through its entry point."""
