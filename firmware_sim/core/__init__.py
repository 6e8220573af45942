"""The matching core of an FPGA: what it decides, bit for bit, and when, to the cycle."""
