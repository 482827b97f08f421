"""One file a use case, from observations to a result; jobs, routes and commands call these."""
