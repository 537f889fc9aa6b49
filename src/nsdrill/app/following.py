"""What a continuation says of itself while it follows branches: how many, how far they
are, for how long at most, and what became of them."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field

from nsdrill.compiler.functions import compiling
from nsdrill.orbit.explore import Wave

Say = Callable[[str], object]
LINE_SECONDS = 10.0  # between two lines


def _seconds() -> float:
    """A clock that stands still where code is compiled [s]."""
    return time.monotonic() - compiling.seconds


@dataclass
class Following:
    """Lines on the waves of branches, through ``say``."""

    say: Say
    number: int = 0
    began: float = field(default_factory=_seconds)
    told: float = field(default_factory=_seconds)

    def settled(self, done: float, duration: float) -> None:
        """Say now and then how much of the time [s] of the seeds has passed."""
        now = _seconds()
        if now - self.told >= LINE_SECONDS:
            self.told = now
            left = (now - self.began) * (duration - done) / max(done, 1e-9)
            self.say(f"{done:.0f} of {duration:g} s settled; about {_time(left)} left")

    def watch(self, wave: Wave) -> None:
        """Say how many branches a wave has at its beginning, then now and then how far
        they are."""
        now = _seconds()
        if wave.number != self.number:
            self.number, self.began, self.told = wave.number, now, now
            self.say(f"round {self.number}: {_branches(wave.branches)} followed side by side, kept when all have ended")
        elif now - self.told >= LINE_SECONDS:
            self.told = now
            limit = wave.left * (now - self.began) / max(wave.longest, 1)
            left = f"at this pace up to {_time(limit)} more in this round"
            self.say(
                f"round {self.number}: {wave.running} of {_branches(wave.branches)} "
                f"go{'es' if wave.running == 1 else ''} on, {wave.points} points; "
                f"{left if wave.left else 'the last special points are located'}"
            )


def _time(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes}:{rest:02d}"


def _branches(number: int) -> str:
    return f"{number} branch{'' if number == 1 else 'es'}"


def dropped_words(followed: int, kept: int) -> str:
    """Why there are fewer branches than were followed; "" where there are not."""
    if followed == kept:
        return ""
    return (
        f"{_branches(followed)} were followed; {followed - kept} of them turned out to be parts of "
        f"others, which other seeds had led to, and count once"
    )
