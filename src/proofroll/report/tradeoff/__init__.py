"""Trade-off between speed and accuracy in a report and on the terminal."""
