"""Start Taichi once, lazily and quietly; the only file that imports it.

One thread owns Taichi: the thread that first calls :func:`start`. A program that the host application has
already initialised is left alone, because a second ``ti.init`` would destroy its fields.
"""

import contextlib
import io
import os
import threading

os.environ.setdefault("ENABLE_TAICHI_HEADER_PRINT", "0")
os.environ["TI_SKIP_VERSION_CHECK"] = "ON"  # exactly ON, or ti.init posts to a server
os.environ.setdefault("TI_ENABLE_PYBUF", "0")  # a redirected stdout is no notebook: no message, no wrapped launches

with contextlib.redirect_stdout(io.StringIO()):
    import taichi as ti

__all__ = ["start", "ti"]

_owner: int | None = None


def start(threads: int | None = None) -> None:
    """Initialise Taichi for the CPU, unless that was done before (here or by the host program).

    ``threads`` bounds the worker threads; ``None`` reads ``TIEGOCANCEL_THREADS`` and otherwise takes all cores.
    Results never depend on it. Raise ``RuntimeError`` when called from a thread that does not own Taichi.
    """
    global _owner
    here = threading.get_ident()
    if _owner is not None:
        if _owner != here:
            raise RuntimeError("Taichi was started on another thread: call the kernels from that thread only")
        return
    if ti.lang.impl.get_runtime().prog is None:
        wanted = threads or int(os.environ.get("TIEGOCANCEL_THREADS", "0")) or os.cpu_count() or 1
        with contextlib.redirect_stdout(io.StringIO()):
            ti.init(arch=ti.cpu, cpu_max_num_threads=wanted, log_level=ti.ERROR, offline_cache=True)
    _owner = here
