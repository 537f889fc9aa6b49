"""Measurements of nsdrill: against its peers, and by itself. See README.md."""
