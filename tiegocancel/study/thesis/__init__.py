"""Rerun every experiment of the thesis, with the controls that it lacks, and compare its figures with ours."""
