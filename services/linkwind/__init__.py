"""linkwind: co-simulation of mechanisms moving in a flow."""

__version__ = "0.1.0"
