"""The line that long calls show."""

import sys
import time


class Line:
    """One line on sys.stderr: rewritten in place on a terminal, else a line every five seconds and at the end.

    Nothing is shown of what ends within a second."""

    def __init__(self, title):
        self.title = title
        self.start = self.shown = time.monotonic()
        self.terminal = sys.stderr.isatty()

    def __call__(self, done, what):
        now = time.monotonic()
        end = done >= 1
        if now - self.start < 1 or (not end and now - self.shown < (0.2 if self.terminal else 5)):
            return
        self.shown = now
        elapsed = now - self.start
        left = f"{elapsed * (1 - done) / done:.0f} s left" if done > 0.01 else "? s left"
        sys.stderr.write(
            f"{chr(13) + chr(27) + '[K' if self.terminal else ''}{self.title} {100 * done:3.0f} %  "
            f"{elapsed:.0f} s elapsed, {left}  {what}{'' if self.terminal and not end else chr(10)}"
        )
        sys.stderr.flush()
