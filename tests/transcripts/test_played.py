"""The player of transcripts."""

import pytest
from cli.helpers import Answer

from .played import written

TRANSCRIPT = """\
-- A remark stays.
$ nsdrill show 'a file.h5'
what was printed once
! and said
= 3

$ echo a line of a shell
"""


def test_a_transcript_has_what_commands_print_now(tmp_path):
    given = []

    def call(*words, code):
        given.append(words)
        return Answer(2, f"{tmp_path}/a: made 2026-11-28T10:00:00Z by nsdrill 0.2.0.\n\n12 steps in 0.1 s.", "Error\n")

    found = written(TRANSCRIPT, call, tmp_path)
    assert given == [("show", "a file.h5")]
    assert (
        found
        == """\
-- A remark stays.
$ nsdrill show 'a file.h5'
<folder>/a: made <time> by nsdrill <version>.

12 steps in <seconds>.
! Error
= 2

$ echo a line of a shell
a line of a shell

"""
    )
    assert written(found, call, tmp_path) == found


@pytest.mark.parametrize("line", ["$ nsdrill show", "-- a remark"])
def test_what_would_be_read_as_a_command_or_a_remark_is_no_output(tmp_path, line):
    with pytest.raises(AssertionError):
        written("$ nsdrill show\n", lambda *words, code: Answer(0, line, ""), tmp_path)
