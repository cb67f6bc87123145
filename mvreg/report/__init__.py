"""The results of a run: result.json, pairs.csv, and the tables on the screen."""
