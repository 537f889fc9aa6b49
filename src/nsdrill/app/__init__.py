"""The use cases, one module each: the functions behind the commands and the Python
functions."""
