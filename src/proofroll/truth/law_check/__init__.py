"""Each route of a truth held against the laws: records, states between samples, verdict that ends a truth."""
