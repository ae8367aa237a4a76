"""The same decisions on every processor: comparisons and tests run again under other kinds of arithmetic."""
