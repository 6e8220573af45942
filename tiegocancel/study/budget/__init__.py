"""Judge parts on a recording: does it fit, does it keep up, and if not, what gives."""
