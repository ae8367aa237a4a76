"""Two versions of one engine on the same cases, and their differences."""
