"""What a run leaves behind: result.json, pairs.csv and the tables on the screen."""
