"""Limits of wall seconds for one run; time in which others had the processor does not count."""

# A run that somebody asked for: a row of a comparison at a point, an engine's reading of a robot file.
TIME_LIMIT = 120.0
# A single run from the command line, whose user may stop it by hand.
RUN_TIME_LIMIT = 600.0
# One of the many runs of a study, which has others to go on with.
STUDY_TIME_LIMIT = 60.0
