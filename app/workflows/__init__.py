"""How a use case flows from observations to a result, one file each; jobs, routes and commands call these."""
