"""Functional mock-up units: the dynamics, or a force model, as one file that runs anywhere without Python.

>>> from linkwind.fmi.export import export
>>> export(load("two_link"), Path("two_link.fmu"), fmi="3")
Exported(file=PosixPath('two_link.fmu'), bytes=116019, fmi='3', platforms=('x86_64-linux',))
"""
