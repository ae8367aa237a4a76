"""Result of one run: text, plot and replay."""
