"""What routes, sockets and commands share and which is not HTTP."""
