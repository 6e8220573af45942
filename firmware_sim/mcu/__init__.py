"""The canceller as a firmware: what its loop costs on a microcontroller, event by event."""
