"""The pages for a browser: the explorer, served on this machine, and the report, a
self-contained file."""
