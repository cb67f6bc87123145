"""Evidence for or against a relative pose, and the probability that follows from it."""
