"""Routes by subject: a file for those that belong together, with a `router` that the table of capabilities names."""
