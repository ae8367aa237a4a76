"""Limits of wall time [s]; time in which other processes had the processor does not count."""

# A run of a comparison, or an engine's reading of a robot file.
TIME_LIMIT = 120.0
# A single run from the command line, whose user may stop it by hand.
RUN_TIME_LIMIT = 600.0
# Part of a run's limit that a truth may take with its samples, as processor time; the last checks have the rest.
FOR_A_TRUTH = 0.8
# One of the many runs of a study.
STUDY_TIME_LIMIT = 60.0
# The program of a finding, or the writing of an engine's model file.
PROGRAM_TIME_LIMIT = 300.0

# The first answer of a worker, or of an engine about itself, which may have to read packages from a cold disk.
HELLO_TIME_LIMIT = 60.0
