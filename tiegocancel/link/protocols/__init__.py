"""Turn bytes of a link into events and back, one wire protocol a file."""
