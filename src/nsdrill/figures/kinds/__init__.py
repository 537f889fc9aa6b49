"""The pictures, a file for each kind or a few: it declares them as ``KINDS`` and draws
them. The registry loads every file of this package."""
