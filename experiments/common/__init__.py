"""What several experiments share: runs, scenes, figures."""
