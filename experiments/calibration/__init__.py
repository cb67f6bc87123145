"""Which measures separate right pairs from wrong ones, and the weights of the evidence."""
