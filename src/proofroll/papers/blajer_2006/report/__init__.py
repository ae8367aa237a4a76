"""Report of balls on surfaces besides verdicts and curves: slips, regime maps, drawings, the replay."""
