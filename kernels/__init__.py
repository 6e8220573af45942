"""Taichi kernels: numpy arrays in, numpy arrays out. Nothing here knows files, configs or hardware."""
