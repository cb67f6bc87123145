"""Which measures separate correct pairs from wrong ones, and the weights of the evidence."""
