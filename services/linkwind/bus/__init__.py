"""Transports: each moves ``(key, bytes)`` between the dynamics and its providers."""
