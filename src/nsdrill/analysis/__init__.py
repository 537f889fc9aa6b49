"""Analysis of the results of many points: numbers in, numbers out, no files and no
pictures."""
