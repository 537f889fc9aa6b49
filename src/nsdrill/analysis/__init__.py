"""What the results of many points say together. Plain numbers in, plain numbers out: no
files, no pictures."""
