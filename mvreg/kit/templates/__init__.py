"""A working stage of every kind, a reader and an observer: what ``mvreg new-plugin`` begins with.

The names in them, ``nameless`` and ``Nameless``, become the plugin's.
"""
