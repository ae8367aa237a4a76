"""Our own engine adapters; each follows :class:`proofroll.core.engine.Engine` and is found through its entry point."""
