"""Long calls end on Ctrl-C and on an error of the progress function, and leave nothing running."""

import os
import signal
import subprocess
import sys
import threading
import time
import unittest

import swatch
import selvedge

LONG = {
    "fit": "selvedge.fit(swatch.campaign(), cells=40, max_iterations=100, progress=told)",
    "diagnose": "selvedge.diagnose(swatch.campaign(), cells=32, progress=told)",
    "simulate": "swatch.swing(seconds=600, of=[swatch.material()] * 64)",
    "residuals": "selvedge.Simulation(swatch.campaign(), cells=64).derivatives(swatch.TRUE)",
}
SCRIPT = """
import sys, time
import selvedge, swatch
def told(done, what): pass
print("begins", flush=True)
try:
    {call}
    print("ended by itself")
except KeyboardInterrupt:
    print("KeyboardInterrupt", flush=True)
print(len(selvedge.effects()), "alive")
"""


class Stopping(unittest.TestCase):
    def test_ctrl_c_ends_a_long_call(self):
        for name, call in LONG.items():
            with self.subTest(name):
                child = subprocess.Popen(
                    [sys.executable, "-c", SCRIPT.format(call=call)], stdout=subprocess.PIPE, text=True,
                    cwd=os.path.dirname(os.path.abspath(__file__)),
                )
                self.assertEqual(child.stdout.readline(), "begins\n")
                time.sleep(3)
                sent = time.monotonic()
                child.send_signal(signal.SIGINT)
                said = child.stdout.readline()
                took = time.monotonic() - sent
                print(f"{name}: {said.strip()} after {took:.2f} s", file=sys.stderr)
                rest = child.stdout.read()
                child.stdout.close()
                child.wait()
                self.assertEqual(said, "KeyboardInterrupt\n", said + rest)
                self.assertIn("alive", rest)
                self.assertEqual(child.returncode, 0)

    def test_an_error_of_the_progress_function_ends_the_call(self):
        class Enough(Exception):
            pass

        def told(done, what):
            raise Enough(what)

        with self.assertRaises(Enough):
            selvedge.fit(swatch.campaign(), cells=9, progress=told)
        self.assertEqual([t for t in threading.enumerate() if t is not threading.main_thread()], [])

    def test_a_simulation_that_was_stopped_goes_on_afterwards(self):
        simulation = selvedge.Simulation(swatch.campaign(), cells=9)
        signal.signal(signal.SIGALRM, lambda *_: (_ for _ in ()).throw(TimeoutError()))
        signal.setitimer(signal.ITIMER_REAL, 0.05)
        try:
            for _ in range(1000):
                simulation.derivatives(swatch.TRUE)
            self.fail("nothing was stopped")
        except TimeoutError:
            pass
        finally:
            signal.setitimer(signal.ITIMER_REAL, 0)
        self.assertLess(simulation.rms_mm(swatch.TRUE)["static-1"], 1)


if __name__ == "__main__":
    unittest.main()
