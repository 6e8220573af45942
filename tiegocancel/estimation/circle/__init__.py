"""Find centre and ω as the thesis does (§3.3, §3.6): a circle fit and the differences of a marker's bearing."""
