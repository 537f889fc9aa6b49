"""The use cases, one file each: what the commands do, for scripts as well."""
