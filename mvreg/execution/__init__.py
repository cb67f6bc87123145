"""Who works on the tasks of a run: the threads of this process, or workers elsewhere."""
