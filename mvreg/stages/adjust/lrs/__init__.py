"""LRS: low-rank and sparse decomposition of relative motions."""
