"""The hardware side: what the canceller costs on a device. No Taichi, no serial port."""
