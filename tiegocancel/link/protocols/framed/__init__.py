"""Speak our own framed protocol, for people who design a device; ``framed.md`` specifies it."""
