"""A referee of truths: random mechanisms, solved by equations that share nothing with the package's."""
