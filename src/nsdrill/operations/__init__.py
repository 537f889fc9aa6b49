"""What nsdrill can do, each operation once: an annotated function from whose arguments
the command, the function for Python, their help and the tables of the pages are made."""
