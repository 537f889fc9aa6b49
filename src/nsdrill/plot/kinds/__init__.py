"""The pictures, one file a kind: each declares its ``KINDS`` and draws them. The
registry finds whatever is in here."""
