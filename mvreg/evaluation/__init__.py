"""How good poses are: errors beside ground truth, and confidence without it."""
