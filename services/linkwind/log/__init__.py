"""The log of a run, an MCAP file: written by the dynamics, read by everything that looks at runs.

``linkwind.log.writer`` and ``linkwind.log.state`` write, ``linkwind.log.reader`` and
``linkwind.log.tables`` read; nothing is imported here, because the two sides need different libraries.
"""
