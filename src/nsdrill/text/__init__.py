"""What was found, in words and tables for people to read."""
