"""What is shown in a browser: the explorer, a small server on this machine, and the
report, a file of its own."""
