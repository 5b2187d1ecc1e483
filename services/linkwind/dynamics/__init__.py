"""The dynamics: it owns time and the rigid bodies, and asks the providers for the forces on them."""
