"""Find the ego-motion: from events, from a gyroscope, or both; and tell what is wrong with it.

Modules are loaded one by one where they are needed: ``circle`` (the thesis's estimator), ``track`` (contrast, causal),
``fit`` (contrast, one rotation for a recording), ``gyro``, ``gyro_files``, ``gyro_bias``, ``time_offset``, ``fusion``,
``diagnose``.
"""
