"""What tells right pairs from wrong ones, and the weights of the judge by evidence."""
