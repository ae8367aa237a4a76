"""What a report shows of balls on surfaces besides verdicts and curves: slips, regime maps, drawings, the replay."""
