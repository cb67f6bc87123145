"""Finished work, kept on disk under what it follows from, to be found instead of done again.

A prepared scan or an attempted pair depends on points, stages, parameters and versions alone. Its
entry is found by a hash of all of them (`mvreg.store.content`), so nothing has to be looked up,
told or kept up to date: what has changed is simply not found. Entries are plain arrays and a
description of how they make up a record (`mvreg.store.codec`), never pickled objects; they are
written aside and moved into place, so that none is ever seen half written (`mvreg.store.folder`).
"""
