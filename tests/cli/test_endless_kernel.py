"""A kernel that does not end: a second signal ends the process all the same."""

from __future__ import annotations

import signal
import subprocess
import sys

import pytest

from clpt.cli.process import ending

pytestmark = pytest.mark.skipif(sys.platform == "win32", reason="signals of POSIX")
SPINS = """
import signal, sys
import numpy as np, pyopencl as cl
from clpt import device
from clpt.cli.process import ending
for number in (signal.SIGINT, *ending.ENDING):
    signal.signal(number, signal.SIG_DFL)  # a shell ignores Ctrl-C in the background
ending.raise_at_signals()
ending.end_at_second()
on = device.choose()
text = "kernel void spin(global volatile int *x) { while (x[0] == 0) x[1]++; }"
program = cl.Program(on.queue.context, text).build()
buffer = cl.Buffer(on.queue.context, cl.mem_flags.READ_WRITE, 64)
cl.enqueue_fill_buffer(on.queue, buffer, np.int32(0), 0, 64)
on.queue.finish()
kernel = cl.Kernel(program, "spin")
kernel.set_arg(0, buffer)
with ending.stops():
    cl.enqueue_nd_range_kernel(on.queue, kernel, (1,), None)
    on.queue.flush()
    print("begun", flush=True)
    on.queue.finish()
"""


@pytest.mark.parametrize("number", [signal.SIGINT, *ending.ENDING], ids=lambda n: n.name)
def test_a_second_signal_ends_a_process_whose_kernel_does_not_end(number: signal.Signals) -> None:
    process = subprocess.Popen(
        [sys.executable, "-c", SPINS], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    try:
        assert process.stdout is not None
        assert process.stdout.readline() == "begun\n"
        process.send_signal(number)
        with pytest.raises(subprocess.TimeoutExpired):  # the first one waits for what is whole
            process.wait(2 * ending.GRACE)
        process.send_signal(number)
        _, told = process.communicate(timeout=60)  # without the thread it never ends
    finally:
        process.kill()
    assert process.returncode == ending.STATUS + number and "interrupted" in told
