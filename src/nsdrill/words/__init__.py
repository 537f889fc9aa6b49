"""What the numbers of an analysis say in words: the answer to a window, warnings, values with
their units, names of quantities. Text, pictures and pages say the same; no picture is known
here, and no file."""
